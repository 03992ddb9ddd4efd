#include "clients/rig/metrics.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "clients/rig/ask.h"

namespace rig::client {

namespace {

std::string as_text(const protocol::Metrics& metrics) {
  std::string out;
  for (const auto& metric : metrics.metrics()) {
    const std::string name = metric.bus().empty() ? metric.name() : metric.name() + " " + metric.bus();
    out += fmt::format("{:42} {:<16g} {}\n", name, metric.value(), metric.help());
  }
  return out;
}

std::string as_json(const protocol::Metrics& metrics) {
  nlohmann::ordered_json out;
  for (const auto& metric : metrics.metrics()) {
    if (metric.bus().empty()) {
      out[metric.name()] = metric.value();
    } else {
      out[metric.name()][metric.bus()] = metric.value();
    }
  }
  return out.dump(2) + "\n";
}

// The lines of one name must stand together.
std::string as_prometheus(const protocol::Metrics& metrics) {
  std::string out;
  std::set<std::string> told;
  for (const auto& first : metrics.metrics()) {
    if (!told.insert(first.name()).second) continue;
    out += fmt::format("# HELP {} {}\n# TYPE {} {}\n", first.name(), first.help(), first.name(),
                       first.counter() ? "counter" : "gauge");
    for (const auto& metric : metrics.metrics()) {
      if (metric.name() != first.name()) continue;
      const std::string label = metric.bus().empty() ? "" : fmt::format("{{bus=\"{}\"}}", metric.bus());
      out += fmt::format("{}{} {}\n", metric.name(), label, metric.value());
    }
  }
  return out;
}

}  // namespace

std::string describe_metrics(const protocol::Metrics& metrics, MetricsFormat format) {
  switch (format) {
    case MetricsFormat::text:
      return as_text(metrics);
    case MetricsFormat::json:
      return as_json(metrics);
    case MetricsFormat::prometheus:
      return as_prometheus(metrics);
  }
  return {};
}

Result<void> metrics(const Connection& to, MetricsFormat format) {
  protocol::Request request;
  request.mutable_get_metrics();
  const auto reply = ask(to, request, to.wait_s);
  if (!reply) return base::pass(reply);
  std::fputs(describe_metrics(reply->metrics(), format).c_str(), stdout);
  return {};
}

}  // namespace rig::client
