#include "clients/rig/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace rig::client {
namespace {

protocol::Metrics some() {
  protocol::Metrics metrics;
  const auto put = [&](const char* name, double value, bool counter, const char* bus) {
    auto& metric = *metrics.add_metrics();
    metric.set_name(name);
    metric.set_value(value);
    metric.set_counter(counter);
    metric.set_bus(bus);
    metric.set_help("Help.");
  };
  put("rig_frames_total", 12, true, "");
  put("rig_bus_waiting", 1, false, "virtual/axes");
  put("rig_disk_free_bytes", 123456789012.0, false, "");
  put("rig_bus_waiting", 2, false, "virtual/camera");
  return metrics;
}

TEST(Metrics, PrometheusGroupsWhatHasOneNameAndKeepsEveryDigit) {
  EXPECT_EQ(describe_metrics(some(), MetricsFormat::prometheus),
            "# HELP rig_frames_total Help.\n# TYPE rig_frames_total counter\nrig_frames_total 12\n"
            "# HELP rig_bus_waiting Help.\n# TYPE rig_bus_waiting gauge\n"
            "rig_bus_waiting{bus=\"virtual/axes\"} 1\nrig_bus_waiting{bus=\"virtual/camera\"} 2\n"
            "# HELP rig_disk_free_bytes Help.\n# TYPE rig_disk_free_bytes gauge\n"
            "rig_disk_free_bytes 123456789012\n");
}

TEST(Metrics, JsonPutsTheBusesBelowTheName) {
  const auto json = nlohmann::json::parse(describe_metrics(some(), MetricsFormat::json));
  EXPECT_EQ(json["rig_frames_total"], 12);
  EXPECT_EQ(json["rig_bus_waiting"]["virtual/camera"], 2);
  EXPECT_EQ(json["rig_disk_free_bytes"], 123456789012.0);
}

TEST(Metrics, TextHasALineForEach) {
  const std::string text = describe_metrics(some(), MetricsFormat::text);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4);
  EXPECT_THAT(text, testing::HasSubstr("rig_bus_waiting virtual/camera"));
}

}  // namespace
}  // namespace rig::client
