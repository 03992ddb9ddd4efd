// Setting up a rig: the programs as a person or a script runs them, before the virtual rig.
#include <gmock/gmock.h>
#include <regex>

#include "tests/system/running_rig.h"

namespace rig {
namespace {

using ::testing::HasSubstr;

class Unhomed : public testing::Test {
 protected:
  Unhomed() { rig_.start(); }

  // `rig ...` with these answers; what it printed stays in `log_`.
  int rig(const std::string& arguments, const std::string& answers = {}) {
    test::put_bytes(folder_ / "answers", answers);
    const std::string command = test::program_path("rig") + " " + arguments + " --endpoint ipc://" +
                                (folder_ / "run/operate.sock").string() + " --config " + config_.string() +
                                " < " + (folder_ / "answers").string() + " > " + (folder_ / "log").string() +
                                " 2>&1";
    const int status = test::in_child([&] {
      ::execl("/bin/bash", "bash", "--norc", "-c", command.c_str(), nullptr);
      return 127;
    });
    log_ = test::bytes_in(folder_ / "log");
    return status;
  }
  double figure(const std::string& name) const {
    std::smatch found;
    EXPECT_TRUE(std::regex_search(log_, found, std::regex("(^|\n)" + name + " ([0-9.e+-]+)"))) << log_;
    return found.empty() ? -1 : std::stod(found[2]);
  }

  test::TemporaryFolder folder_;
  test::RunningRig rig_{folder_.path()};
  const std::filesystem::path config_ = folder_ / "rig.toml";
  std::string log_;
};

class SettingUp : public Unhomed {
 protected:
  SettingUp() {
    protocol::Request home;
    home.mutable_home();
    rig_.expect_done(home);
    protocol::Request light;
    light.mutable_set_light()->set_on(true);
    light.mutable_set_light()->set_shutter_open(true);
    rig_.expect_done(light);
  }
};

TEST_F(SettingUp, LiveMeasuresWhatTheCameraSees) {
  ASSERT_EQ(rig("live --once --auto --save " + (folder_ / "last.png").string()), 0) << log_;
  EXPECT_NEAR(figure("level_percent"), 70, 6);
  EXPECT_EQ(figure("fiducials"), 20);
  EXPECT_GT(figure("focus"), 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "last.png"));
  const double good_ms = figure("exposure_ms");

  // The measure does not follow the exposure, but for noise; the figures about clipping do.
  const double focus = figure("focus");
  ASSERT_EQ(rig("live --once --exposure-ms " + std::to_string(good_ms / 2)), 0) << log_;
  EXPECT_NEAR(figure("focus") / focus, 1, 0.2);
  ASSERT_EQ(rig("live --once --exposure-ms " + std::to_string(10 * good_ms)), 0) << log_;
  EXPECT_GT(figure("saturated_percent"), 1);
}

TEST_F(Unhomed, TheDirectionIsShownBeforeHoming) {
  const auto pan = [this] {
    protocol::Request look;
    look.mutable_get_status();
    return rig_.expect_done(look).status().axes(2);
  };
  while (pan().fault() == "not yet read") {
  }
  const double before_deg = pan().position_deg();
  // Not the positive sense; there is no key to turn, and nothing is homed.
  ASSERT_EQ(rig("axis setup pan", "y\nagain\nn\n"), 0) << log_;
  EXPECT_THAT(log_, HasSubstr("moves by -2 deg"));
  EXPECT_THAT(log_, HasSubstr("By hand: Turn the direction of pan round"));
  EXPECT_NEAR(pan().position_deg(), before_deg + 2, 0.02);
  EXPECT_FALSE(pan().homed());
}

TEST_F(SettingUp, AnAxisIsSetUpAndRigdStartsWithTheChangedFile) {
  const std::string before = test::bytes_in(config_);
  // Direction right, scale right, a nearer lower limit, the upper one kept, homing right, written.
  ASSERT_EQ(rig("axis setup pan", "y\ny\ny\n20\n60\nhere\nkeep\ny\ny\n"), 0) << log_;
  EXPECT_THAT(log_, HasSubstr("-min_deg = -90.0\n+min_deg = "));
  EXPECT_THAT(log_, HasSubstr("as rig.toml has it"));
  const std::string after = test::bytes_in(config_);
  EXPECT_NE(after, before);
  EXPECT_THAT(after, HasSubstr("# docs/virtual-rig.md explains each key."));
  EXPECT_EQ(rig_.end(SIGTERM), 0);
  rig_.start();
  protocol::Request look;
  look.mutable_get_status();
  const auto status = rig_.expect_done(look).status();
  EXPECT_NEAR(status.axes(2).min_deg(), 22 - 60, 3);
  EXPECT_EQ(status.axes(2).max_deg(), 90);
}

}  // namespace
}  // namespace rig
