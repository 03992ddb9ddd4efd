// Limit switches on a board of lines, by its real driver and the wall's time: the axes know nothing of them.
#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "sim/wire/line_board.h"
#include "tests/system/running_rig.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr unsigned int kLow = 0, kHigh = 1;
constexpr milliseconds kTwoLooks{1200};  // the regular ones are 0.5 s apart

// The axes and the emergency stop are the virtual rig's, so that there are two devices of lines.
std::string rig_toml(const std::filesystem::path& socket) {
  std::string text = tiny_rig_toml();
  const std::string clock = "clock = \"discrete-event\"\n";
  text.erase(text.find(clock), clock.size());
  // Slow enough to be pressed on the way.
  for (const char* key : {"homing_velocity_deg_s = 20.0", "jog_velocity_deg_s = 20.0"}) {
    const auto table = text.find(key[0] == 'h' ? "[module.settings.axis.pan]" : "[axis.pan]");
    const auto at = text.find(key, table);
    EXPECT_NE(at, std::string::npos) << key;
    text.replace(at + std::string_view(key).size() - 4, 4, "4.0");
  }
  text += fmt::format(
      "\n[[module]]\nname = \"board\"\nfile = \"gpiod_lines\"\n[module.settings]\nchip = \"unix:{}\"\n"
      "[module.settings.input.pan_low]\nline = \"low\"\n[module.settings.input.pan_high]\nline = \"high\"\n",
      socket.string());
  for (const char* end : {"low", "high"}) {
    text += fmt::format(
        "\n[lines.limit.pan.{0}]\nmodule = \"board\"\ndevice = \"lines\"\nline = \"pan_{0}\"\n", end);
  }
  return text;
}

class LimitBoard : public ::testing::Test {
 protected:
  void SetUp() override {
    board_.drive(kLow, false);
    board_.drive(kHigh, false);
    ASSERT_EQ(run_program("rigd", {"--check", "--config", folder_ / "rig/rig.toml"}, folder_ / "check.log"),
              0)
        << bytes_in(folder_ / "check.log");
    ASSERT_NO_FATAL_FAILURE(rig_.start());
    std::this_thread::sleep_for(kTwoLooks);
  }
  static protocol::Request jog(double by_deg) {
    protocol::Request request;
    request.mutable_jog()->set_axis("pan");
    request.mutable_jog()->set_by_deg(by_deg);
    return request;
  }
  protocol::Status status() {
    protocol::Request look;
    look.mutable_get_status();
    return rig_.expect_done(look).status();
  }
  double pan_deg() { return status().axes(2).position_deg(); }
  void clear() {
    protocol::Request request;
    request.mutable_clear_stop();
    rig_.expect_done(request);
    std::this_thread::sleep_for(kTwoLooks);
  }
  void wait_until_pan_moves() {
    const double here_deg = pan_deg();
    while (std::abs(pan_deg() - here_deg) < 0.5) {
    }
  }
  // Of the stop that comes next.
  std::string await_stop() {
    std::string reason;
    EXPECT_TRUE(rig_.await([&](const protocol::Event& event) {
      if (event.has_stop_latched()) reason = event.stop_latched().reason();
      return event.has_stop_latched();
    })) << rig_.log();
    return reason;
  }

  TemporaryFolder folder_;
  sim::wire::LineBoard board_{folder_ / "lines", {"low", "high"}};
  RunningRig rig_{folder_ / "rig", rig_toml(folder_ / "lines")};
};

TEST_F(LimitBoard, AnAxisIsStoppedByItsSwitchAndGoesOutOnly) {
  rig_.send(jog(-10));  // 2.5 s
  wait_until_pan_moves();
  board_.drive(kLow, true);
  const auto pressed = steady_clock::now();
  EXPECT_EQ(await_stop(), "axis pan ran into its low limit switch");
  EXPECT_LT(steady_clock::now() - pressed, milliseconds(400));
  clear();
  EXPECT_TRUE(status().axes(2).at_low_limit());
  EXPECT_FALSE(status().axes(2).at_high_limit());
  const auto further_in = rig_.ask(jog(-1));
  EXPECT_EQ(further_in.outcome(), protocol::REFUSED);
  EXPECT_THAT(further_in.reason(), HasSubstr("axis pan stands on its low limit switch"));
  EXPECT_EQ(rig_.ask(jog(2)).outcome(), protocol::DONE);
  board_.drive(kLow, false);
  std::this_thread::sleep_for(kTwoLooks);
  EXPECT_FALSE(status().axes(2).at_low_limit());
  EXPECT_EQ(rig_.ask(jog(-1)).outcome(), protocol::DONE);
}

TEST_F(LimitBoard, ATouchOfAMillisecondIsSeen) {
  rig_.send(jog(10));
  wait_until_pan_moves();
  board_.drive_for(kHigh, true, milliseconds(1));
  EXPECT_EQ(await_stop(), "axis pan ran into its high limit switch");
}

TEST_F(LimitBoard, AWireThatComesOffReadsAsTheSwitch) {
  board_.drive(kLow, std::nullopt);  // the pull-up decides
  std::this_thread::sleep_for(kTwoLooks);
  EXPECT_TRUE(status().axes(2).at_low_limit());
  EXPECT_EQ(rig_.ask(jog(-1)).outcome(), protocol::REFUSED);
}

TEST_F(LimitBoard, WithoutItsBoardNothingMovesUntilItIsBack) {
  rig_.send(jog(-10));
  wait_until_pan_moves();
  const double here_deg = pan_deg();
  board_.cut();
  while (status().lost_devices().empty()) {
  }
  EXPECT_THAT(status().lost_devices(0), HasSubstr("lines board/lines: "));
  std::this_thread::sleep_for(kTwoLooks);
  EXPECT_GT(pan_deg(), here_deg - 4) << "stopped long before the end of its way";
  EXPECT_EQ(status().stop_reason(), "");
  EXPECT_EQ(rig_.ask(jog(1)).outcome(), protocol::REFUSED);
  board_.restore();
  const auto patience = steady_clock::now() + std::chrono::seconds(10);
  while (!status().lost_devices().empty() && steady_clock::now() < patience) {
  }
  std::this_thread::sleep_for(kTwoLooks);
  const auto on = rig_.ask(jog(1));
  EXPECT_EQ(on.outcome(), protocol::DONE) << on.reason();
}

}  // namespace
}  // namespace rig::test
