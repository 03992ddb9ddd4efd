// rigd dies in the middle of a move with the shutter open; rigd-safe brings the rig to rest without it. Here
// time is the wall's: the virtual axis goes on by itself after the death of its master, as a real one does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/wire/line_board.h"
#include "tests/system/running_rig.h"

namespace rig::test {

using testing::HasSubstr;

namespace {

// Axes that home at once, and an arm that takes 20 s from 45 to 145 degrees.
std::string slow_rig_toml() {
  std::string text = replaced(small_rig_toml(), "clock = \"discrete-event\"", "clock = \"system\"");
  for (const char* start : {"15.0", "-10.0", "5.0"})
    text = replaced(text, fmt::format("power_on_deg = {}\n", start), "power_on_deg = 0.0\n");
  return replaced(text, "power_on_deg = 60.0\n", "power_on_deg = 45.0\n");
}

// Where the log of rigd-safe says that the arm stands.
double arm_deg(const std::string& log) {
  const std::string before = "axis arm: stands at ";
  const auto at = log.find(before);
  EXPECT_NE(at, std::string::npos) << log;
  return at == std::string::npos ? 0 : std::stod(log.substr(at + before.size()));
}

constexpr double kFrom_deg = 45;
constexpr double kTo_deg = 145;

class Safe : public testing::Test {
 protected:
  // A rig whose arm is under way, with the shutter open.
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(rig_.start());
    protocol::Request home;
    home.mutable_home();
    rig_.expect_done(home);
    protocol::Request light;
    light.mutable_set_light()->set_on(true);
    light.mutable_set_light()->set_shutter_open(true);
    rig_.expect_done(light);
    protocol::Request move;
    auto& arm = *move.mutable_move()->add_axes();
    arm.set_axis("arm");
    arm.set_angle_deg(kTo_deg);
    rig_.send(move);
    await_empty_bus();
  }
  // What was queued at the bus of the axes before is carried out: rigd looks at them twice a second.
  void await_empty_bus() {
    const auto done = [this](double& waiting) {
      protocol::Request ask;
      ask.mutable_get_metrics();
      double count = 0;
      const auto reply = rig_.expect_done(ask);
      for (const auto& metric : reply.metrics().metrics()) {
        if (metric.bus() != "virtual/axes") continue;
        if (metric.name() == "rig_bus_transactions_total") count = metric.value();
        if (metric.name() == "rig_bus_waiting") waiting = metric.value();
      }
      return count;
    };
    double waiting = 0;
    const double before = done(waiting);
    const double enough = before + waiting + 1;
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (done(waiting) < enough) ASSERT_LT(std::chrono::steady_clock::now(), end);
  }
  [[nodiscard]] protocol::Status status() {
    protocol::Request look;
    look.mutable_get_status();
    return rig_.expect_done(look).status();
  }
  [[nodiscard]] std::string rigd_safe(int expected) {
    const auto log = folder_ / fmt::format("safe{}.log", ++runs_);
    const int status = run_program(
        "rigd-safe",
        {"--config", rig_.folder() / "rig.toml", "--state", rig_.folder() / "state", "--within-s", "15"},
        log);
    EXPECT_EQ(status, expected) << bytes_in(log);
    return bytes_in(log);
  }

  TemporaryFolder folder_;
  RunningRig rig_{folder_ / "rig", slow_rig_toml()};
  int runs_ = 0;
};

}  // namespace

TEST_F(Safe, StopsTheAxesAndClosesTheShutterAfterRigdWasKilled) {
  EXPECT_EQ(rig_.end(SIGKILL), -SIGKILL);
  const std::string log = rigd_safe(0);
  const double stopped_deg = arm_deg(log);
  EXPECT_GT(stopped_deg, kFrom_deg) << "the move had not begun, so nothing was tested";
  EXPECT_LT(stopped_deg, kTo_deg - 1);
  EXPECT_THAT(log, HasSubstr("light: shutter closed"));
  // It stays there: a second look, a program's start later.
  EXPECT_EQ(arm_deg(rigd_safe(0)), stopped_deg);
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  await_empty_bus();
  EXPECT_NEAR(status().axes(3).position_deg(), stopped_deg, 1e-3);
  EXPECT_FALSE(status().light().shutter_open());
}

TEST_F(Safe, LeavesTheRigToARunningRigd) {
  EXPECT_THAT(rigd_safe(1), HasSubstr("rigd is running"));
}

TEST_F(Safe, AnAskedEndLeavesARigAtRest) {
  EXPECT_EQ(rig_.end(SIGTERM), 0) << rig_.log();
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  await_empty_bus();
  // It may still brake: rigd commands the stop and does not wait for its end.
  auto arm = status().axes(3);
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (arm.moving()) {
    ASSERT_LT(std::chrono::steady_clock::now(), end);
    arm = status().axes(3);
  }
  EXPECT_GT(arm.position_deg(), kFrom_deg);
  EXPECT_LT(arm.position_deg(), kTo_deg - 1);
  EXPECT_FALSE(status().light().shutter_open());
}

// A module that offers only lines: a valve that rigd opens at its start.
TEST(SafeProgram, BringsOutputsToRestThatBelongToNoLight) {
  const TemporaryFolder folder;
  sim::wire::LineBoard board(folder / "board", {"valve", "fan", "button"});
  const std::string module = fmt::format(R"(
[[module]]
name = "board"
file = "gpiod_lines"
[module.settings]
chip = "unix:{}"
[module.settings.output.valve]
line = "valve"
at_start = "active"
[module.settings.output.fan]
line = "fan"
at_start = "active"
at_exit = "keep"
[module.settings.input.button]
line = "button"

)",
                                         board.path().string());
  RunningRig rig(folder / "rig", replaced(slow_rig_toml(), "[axis.roll]\n", module + "[axis.roll]\n"));
  ASSERT_NO_FATAL_FAILURE(rig.start());
  EXPECT_TRUE(board.high(0));
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
  EXPECT_TRUE(board.high(0)) << "nobody has closed it yet";
  const auto log = folder / "log";
  EXPECT_EQ(run_program("rigd-safe",
                        {"--config", rig.folder() / "rig.toml", "--state", rig.folder() / "state"}, log),
            0)
      << bytes_in(log);
  EXPECT_THAT(bytes_in(log), HasSubstr("outputs of 'board': valve inactive, fan active, left as it is"));
  EXPECT_FALSE(board.high(0));
  EXPECT_TRUE(board.high(1));
  // A board that is gone is no reason to say that all is well.
  board.cut();
  EXPECT_EQ(run_program("rigd-safe",
                        {"--config", rig.folder() / "rig.toml", "--state", rig.folder() / "state"}, log),
            1);
  EXPECT_THAT(bytes_in(log), HasSubstr("outputs of 'board': NOT SAFE"));
  EXPECT_THAT(bytes_in(log), HasSubstr("light: shutter closed")) << "the rest is done all the same";
}

TEST(SafeProgram, SaysWhatIsWrongWithItsConfiguration) {
  const TemporaryFolder folder;
  put_bytes(folder / "rig.toml", "format = 1\n");
  const auto log = folder / "log";
  EXPECT_EQ(run_program("rigd-safe", {"--config", folder / "rig.toml", "--state", folder / "state"}, log), 1);
  EXPECT_THAT(bytes_in(log), HasSubstr("rig.toml"));
}

}  // namespace rig::test
