#include "tests/drivers/cia402_axis/rig.h"

#include <gtest/gtest.h>
#include <mutex>

#include "core/base/units.h"
#include "drivers/cia402_axis/devices.h"

namespace rig::drivers::cia402 {

namespace {

std::mutex log_mutex;
std::string log_lines;

void log_line(base::LogLevel /*level*/, std::string_view message) {
  const std::lock_guard lock(log_mutex);
  log_lines += std::string(message) + "\n";
}

}  // namespace

std::string take_log() {
  const std::lock_guard lock(log_mutex);
  return std::exchange(log_lines, {});
}

sim::wire::CanopenNode::Settings quick_node(int id) {
  sim::wire::CanopenNode::Settings node;
  node.id = id;
  node.drive.start = 0;
  node.drive.low_switch = -kSwitchDeg * kCountsPerDeg;
  node.drive.high_switch = kSwitchDeg * kCountsPerDeg;
  node.drive.low_stop = 1.2 * node.drive.low_switch;
  node.drive.high_stop = 1.2 * node.drive.high_switch;
  return node;
}

std::string settings_text(const std::string& interface, const std::string& more_of_module,
                          const std::string& more_of_axis) {
  return fmt::format(R"(interface = "{}"
answer_ms = 100
{}
[axis.pan]
node = 1
counts_per_deg = {}
zero_deg = {}
max_velocity_deg_s = 250
max_acceleration_deg_s2 = 2000
quick_stop_deceleration_deg_s2 = 3000
homing_method = 17
homing_speed_deg_s = 200
homing_creep_deg_s = 20
homing_acceleration_deg_s2 = 3000
{}
)",
                     interface, more_of_module, kCountsPerDeg, -kSwitchDeg, more_of_axis);
}

TestRig::TestRig(const std::vector<sim::wire::CanopenNode::Settings>& nodes)
    : hub_(folder_ / "can"), station_(hub_.attach(), nodes) {
  for (const auto& node : nodes) station_.power_cycle(node.id);
  (void)take_log();
}

void TestRig::open(const std::string& more_of_module, const std::string& more_of_axis) {
  open_text(settings_text(interface(), more_of_module, more_of_axis));
}

void TestRig::open_text(const std::string& text) {
  close();
  const auto settings = base::ConfigTable::parse(text, "rig.toml");
  ASSERT_TRUE(settings.has_value()) << settings.error().text();
  auto devices = open_devices({"drives", *settings, folder_.path(), *clock_, &log_line});
  ASSERT_TRUE(devices.has_value()) << devices.error().text();
  const auto finished = settings->finish();
  EXPECT_TRUE(finished.has_value()) << finished.error().text();
  devices_ = std::move(*devices);
}

double TestRig::position_deg(int node) {
  return station_.with(node, [](auto& n, auto) { return n.drive().position(); }) / kCountsPerDeg;
}

int TestRig::stops(int node) {
  return station_.with(node, [](auto& n, auto) { return n.drive().stops_seen(); });
}

AxisState TestRig::look(std::size_t i) {
  const auto state = axis(i).state();
  EXPECT_TRUE(state.has_value()) << state.error().text();
  return state ? *state : AxisState{};
}

void TestRig::fail_late(const Result<AxisState>& last) {
  if (!last) {
    ADD_FAILURE() << "not in time; last: " << last.error().text();
  } else {
    ADD_FAILURE() << "not in time; last: at " << base::degrees(last->position_rad) << " enabled "
                  << last->enabled << " moving " << last->moving << " homed " << last->homed << " fault '"
                  << last->fault << "'";
  }
}

void TestRig::make_ready() {
  const auto enabled = axis().enable(true);
  ASSERT_TRUE(enabled.has_value()) << enabled.error().text();
  if (look().homed) return;
  const auto homing = axis().home();
  ASSERT_TRUE(homing.has_value()) << homing.error().text();
  const AxisState end = wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_TRUE(end.homed);
}

void TestRig::move_to_deg(double target) {
  const auto moved = axis().move_to(base::radians(target), base::radians(80), base::radians(400));
  ASSERT_TRUE(moved.has_value()) << moved.error().text();
}

void TestRig::arrive_deg(double target) {
  move_to_deg(target);
  const AxisState end = wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_NEAR(base::degrees(end.position_rad), target, 1 / kCountsPerDeg);
  EXPECT_NEAR(position_deg(), target, 1 / kCountsPerDeg);
}

}  // namespace rig::drivers::cia402
