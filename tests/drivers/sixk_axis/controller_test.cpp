// The driver against a controller on a pseudo-terminal.
#include <gmock/gmock.h>

#include "tests/drivers/sixk_axis/controller_fixture.h"

namespace rig::drivers::sixk {
namespace {

using base::degrees;
using base::ErrorCode;
using base::radians;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class SixkOpening : public testing::ControllerTest {};

TEST_F(SixkOpening, SetsTheControllerUp) {
  start();
  open(std::string("set_up = [\"1HOMBAC1\"]\n") + testing::kArm);
  const auto heard = controller_->heard();
  for (const char* command : {"!ERRLVL4", "!ECHO0", "!EOT13,10,0", "!TREV", "!SCALE0", "!1HOMBAC1", "!1MA1",
                              "!1LH3", "!1DRES", "!1TAS"}) {
    EXPECT_THAT(heard, Contains(command));
  }
  EXPECT_THAT(heard, Not(Contains(StartsWith("!GO"))));
  EXPECT_EQ(devices_.at(0).name, "arm");
  EXPECT_EQ(devices_.at(0).bus, "controller");
  const AxisCapabilities can = axis().capabilities();
  EXPECT_NEAR(can.resolution_rad, radians(1 / 200.0), 1e-12);
  EXPECT_DOUBLE_EQ(can.max_velocity_rad_s, radians(100));
  EXPECT_TRUE(can.has_limit_switches);
  EXPECT_FALSE(can.keeps_position_unpowered);
  EXPECT_DOUBLE_EQ(can.homing_velocity_rad_s.value_or(0), radians(60));
}

TEST_F(SixkOpening, LeavesAMotionAlone) {
  start();
  open();
  make_ready();
  ASSERT_TRUE(go(200).has_value());
  ASSERT_TRUE(wait_until([&] { return controller_->position(1) > 3000; }));
  open();
  EXPECT_TRUE(state().moving);
  EXPECT_TRUE(state().homed);
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 40000);
}

TEST_F(SixkOpening, TheOwnersResolutionHasToAgree) {
  start();
  open(std::string(testing::kArm) + "counts_per_turn = 25000\n");
  const auto opened = try_open(std::string(testing::kArm) + "counts_per_turn = 36000\n");
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::bad_input);
  EXPECT_THAT(opened.error().text(), AllOf(HasSubstr("36000"), HasSubstr("25000")));
  // Unless it is set.
  open(std::string("set_up = [\"1DRES36000\"]\n") + testing::kArm + "counts_per_turn = 36000\n");
}

TEST_F(SixkOpening, ARefusedSetUpCommandIsNamed) {
  start();
  const auto opened = try_open(std::string("set_up = [\"1FROB3\"]\n") + testing::kArm);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::device);
  EXPECT_THAT(opened.error().text(), AllOf(HasSubstr("1FROB3"), HasSubstr("UNDEFINED LABEL")));
}

TEST_F(SixkOpening, ASilentControllerIsLost) {
  sim::wire::Pty nobody(folder_ / "nobody");
  const test::SettingsAtPort settings(&open_devices, std::string("answer_ms = 20\n") + testing::kArm,
                                      nobody.path(), folder_);
  const auto opened = settings.open(*clock_);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::lost);
  // It was told to stop all the same.
  std::string heard;
  EXPECT_TRUE(wait_until([&] {
    heard += nobody.read(std::chrono::milliseconds(10));
    return heard.find("!S1\r\n") != std::string::npos;
  })) << heard;
}

TEST_F(SixkOpening, AnAxisThatTheControllerDoesNotHave) {
  start();
  std::string eighth = testing::kArm;
  eighth.replace(eighth.find("number = 1"), 10, "number = 8");
  const auto opened = try_open(eighth);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::device);
}

// The ways of talking to a controller.
struct Manner {
  const char* name;
  const char* settings;
  int unit;
};

class SixkManners : public testing::ControllerTest, public ::testing::WithParamInterface<Manner> {};

TEST_P(SixkManners, AreUnderstood) {
  Sixk::Setup setup;
  setup.unit = GetParam().unit;
  start(setup);
  open(std::string(GetParam().settings) + testing::kArm);
  make_ready();
  ASSERT_TRUE(go(33).has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 6600);
  EXPECT_NEAR(degrees(state().position_rad), 33, 1e-6);
  ASSERT_TRUE(go(-200).has_value());
  ASSERT_TRUE(wait_until([&] { return controller_->position(1) < 5000; }));
  ASSERT_TRUE(axis().stop().has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->stops(1), 1);
  EXPECT_GT(controller_->position(1), -30000);
  // Answers that went astray are not taken for others.
  controller_->spoil(sim::wire::Answers::Spoil::missing, 1);
  EXPECT_NEAR(degrees(state().position_rad), controller_->position(1) / 200, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Controllers, SixkManners,
                         ::testing::Values(Manner{"level4", "", 0}, Manner{"level1", "error_level = 1\n", 0},
                                           Manner{"echo", "echo = true\n", 0},
                                           Manner{"echo_at_level1", "echo = true\nerror_level = 1\n", 0},
                                           Manner{"addressed", "unit = 3\n", 3},
                                           Manner{"daisy_chain", "unit = 2\necho = true\n", 2},
                                           Manner{"kill", "stop = \"kill\"\n", 0}),
                         [](const auto& each) { return each.param.name; });

class SixkAxis : public testing::ControllerTest {
 protected:
  void SetUp() override {
    start();
    open();
    make_ready();
    controller_->forget_heard();
  }
};

TEST_F(SixkAxis, AMoveSaysAllThatItDependsOn) {
  // 50 deg/s are 0.4 turns a second, 250 deg/s^2 are 2; 12.3456 deg are 2469.12 counts.
  ASSERT_TRUE(go(12.3456, 50, 250).has_value());
  EXPECT_THAT(controller_->heard(),
              ElementsAre("!1TAS", "!1MA1", "!1A2.0000", "!1AD2.0000", "!1V0.4000", "!1D2469", "!GO1"));
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 2469);
}

TEST_F(SixkAxis, IsUnderWayBeforeTheStatusShowsIt) {
  // The controller takes 30 ms until its status says that it moves.
  ASSERT_TRUE(go(20).has_value());
  EXPECT_TRUE(state().moving);
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 4000);
  // Where it stands already it is there.
  ASSERT_TRUE(go(20).has_value());
  EXPECT_FALSE(state().moving);
}

TEST_F(SixkAxis, RatesAreRoundedDown) {
  ASSERT_TRUE(go(5, 33.33, 111.1).has_value());
  // 0.26664 and 0.8888 turns.
  EXPECT_THAT(controller_->heard(), AllOf(Contains("!1V0.2666"), Contains("!1A0.8888")));
  ASSERT_TRUE(wait_until_still());
  ASSERT_TRUE(go(0, 1e4, 1e4).has_value());
  EXPECT_THAT(controller_->heard(), AllOf(Contains("!1V0.8000"), Contains("!1A4.0000")));
  ASSERT_TRUE(wait_until_still());
  const auto slow = go(5, 0.001);
  EXPECT_EQ(slow.error().code, ErrorCode::bad_input);
}

TEST_F(SixkAxis, RefusesNonsense) {
  for (const double bad : {std::nan(""), HUGE_VAL, 0.0, -1.0}) {
    EXPECT_EQ(go(1, bad).error().code, ErrorCode::bad_input);
    EXPECT_EQ(go(1, 1, bad).error().code, ErrorCode::bad_input);
  }
  EXPECT_EQ(go(std::nan("")).error().code, ErrorCode::bad_input);
  EXPECT_EQ(go(6e6).error().code, ErrorCode::bad_input);  // D takes nine digits
  EXPECT_TRUE(controller_->heard().empty());
}

TEST_F(SixkAxis, ALimitSwitchStopsItAndLetsItOut) {
  ASSERT_TRUE(go(100).has_value());
  ASSERT_TRUE(wait_until([&] { return controller_->position(1) > 3000; }));
  controller_->press(1, true, true);
  ASSERT_TRUE(wait_until_still());
  EXPECT_TRUE(state().at_high_limit);
  EXPECT_FALSE(state().at_low_limit);
  EXPECT_TRUE(state().homed);
  const auto further = go(150);
  EXPECT_EQ(further.error().code, ErrorCode::refused);
  EXPECT_THAT(further.error().text(), HasSubstr("INVALID CONDITIONS"));
  ASSERT_TRUE(go(5).has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 1000);
}

TEST_F(SixkAxis, AStallTakesTheReferenceAway) {
  ASSERT_TRUE(go(100).has_value());
  ASSERT_TRUE(wait_until([&] { return controller_->position(1) > 3000; }));
  controller_->stall(1);
  ASSERT_TRUE(wait_until([&] { return !state().fault.empty(); }));
  EXPECT_EQ(state().fault, "the motor has stalled");
  EXPECT_FALSE(state().homed);
  EXPECT_THAT(go(0).error().text(), HasSubstr("stalled"));
  // Acknowledged, it still does not know where it stands, also after a restart: the controller believes it
  // does.
  ASSERT_TRUE(axis().enable(true).has_value());
  EXPECT_EQ(state().fault, "");
  open();
  EXPECT_FALSE(state().homed);
  EXPECT_EQ(go(0).error().code, ErrorCode::refused);
  make_ready();
  EXPECT_EQ(controller_->position(1), 0);
  open();
  EXPECT_TRUE(state().homed);
}

TEST_F(SixkAxis, ADriveFaultIsShownUntilItsCauseIsGone) {
  controller_->set_drive_fault(1, true);
  AxisState now = state();
  EXPECT_EQ(now.fault, "drive fault");
  EXPECT_FALSE(now.enabled);
  EXPECT_FALSE(axis().enable(true).has_value());
  EXPECT_EQ(state().fault, "drive fault");
  controller_->set_drive_fault(1, false);
  ASSERT_TRUE(axis().enable(true).has_value());
  now = state();
  EXPECT_EQ(now.fault, "");
  EXPECT_TRUE(now.enabled);
  EXPECT_FALSE(now.homed);
}

TEST_F(SixkAxis, WithoutCurrentNoReference) {
  ASSERT_TRUE(axis().enable(false).has_value());
  EXPECT_FALSE(controller_->energised(1));
  EXPECT_FALSE(state().enabled);
  EXPECT_FALSE(state().homed);
  EXPECT_EQ(axis().home().error().code, ErrorCode::refused);
  EXPECT_EQ(go(1).error().code, ErrorCode::refused);
  make_ready();
}

TEST_F(SixkAxis, AHomeThatIsNotFoundIsAFault) {
  controller_->hide_home(1, true);
  controller_->press(1, false, true);
  controller_->press(1, true, true);
  ASSERT_TRUE(axis().home().has_value());
  ASSERT_TRUE(wait_until([&] { return !state().fault.empty(); }));
  EXPECT_THAT(state().fault, HasSubstr("search for home"));
  EXPECT_FALSE(state().homed);
  controller_->hide_home(1, false);
  controller_->press(1, false, false);
  controller_->press(1, true, false);
  make_ready();
}

TEST_F(SixkAxis, HomingSaysItsSpeeds) {
  ASSERT_TRUE(go(50).has_value());
  ASSERT_TRUE(wait_until_still());
  controller_->forget_heard();
  ASSERT_TRUE(axis().home().has_value());
  // 60 deg/s are 0.48 turns; it goes down, towards "low".
  EXPECT_THAT(controller_->heard(), ElementsAre("!1TAS", "!1HOMV0.4800", "!1HOMA4.0000", "!HOM1"));
  EXPECT_TRUE(state().moving);
  EXPECT_FALSE(state().homed);
  EXPECT_EQ(go(5).error().code, ErrorCode::busy);
  ASSERT_TRUE(wait_until([&] { return state().homed; }));
  EXPECT_EQ(controller_->position(1), 0);
}

TEST_F(SixkAxis, ASearchForHomeThatIsStoppedIsNone) {
  ASSERT_TRUE(go(100).has_value());
  ASSERT_TRUE(wait_until_still());
  ASSERT_TRUE(axis().home().has_value());
  ASSERT_TRUE(wait_until([&] { return controller_->moving(1) && controller_->position(1) < 19000; }));
  ASSERT_TRUE(axis().stop().has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_FALSE(state().homed);
  EXPECT_GT(controller_->position(1), 1000);
  open();
  EXPECT_FALSE(state().homed);
}

TEST_F(SixkAxis, IsHomedAfterARestartWhileTheControllerHadPower) {
  ASSERT_TRUE(go(44).has_value());
  ASSERT_TRUE(wait_until_still());
  open();
  EXPECT_TRUE(state().homed);
  EXPECT_NEAR(degrees(state().position_rad), 44, 1e-6);
  controller_->power_cycle();
  ASSERT_TRUE(wait_until([&] {
    const auto now = axis().state();
    return now && !now->homed;
  }));
  // Set up again, too.
  controller_->forget_heard();
  make_ready();
  ASSERT_TRUE(go(3).has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 600);
}

class SixkVariants : public testing::ControllerTest {};

TEST_F(SixkVariants, AServoIsCommandedInItsEncodersCounts) {
  Sixk::Setup setup;
  setup.axes[0].servo = true;
  setup.axes[0].resolution = 4000;
  start(setup);
  open(R"([axis.arm]
number = 1
motor = "servo"
counts_per_deg = 100
max_velocity_deg_s = 80.0
max_acceleration_deg_s2 = 400.0
home_velocity_deg_s = 40.0
)");
  EXPECT_THAT(controller_->heard(), AllOf(Contains("!1ERES"), Not(Contains("!1DRES"))));
  make_ready();
  controller_->forget_heard();
  ASSERT_TRUE(go(10, 80, 400).has_value());
  EXPECT_THAT(controller_->heard(), Contains("!1V2.0000"));
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), 1000);
  EXPECT_THAT(controller_->heard(), AllOf(Contains("!1TPE"), Not(Contains("!1TPM"))));
  // Too far from where it should be: a fault; its encoder counts on, so that it stays homed.
  controller_->lose_position(1);
  EXPECT_THAT(state().fault, HasSubstr("position error"));
  EXPECT_TRUE(state().homed);
}

TEST_F(SixkVariants, AnEncoderTellsWhereAStepperIs) {
  start();
  // 4000 counts a turn of 125 degrees.
  open(std::string(testing::kArm) + "encoder_counts_per_deg = 32\n");
  make_ready();
  ASSERT_TRUE(go(40).has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_NEAR(degrees(state().position_rad), 40, 1e-6);
  EXPECT_NEAR(axis().capabilities().resolution_rad, radians(1 / 32.0), 1e-12);
  controller_->slip_encoder(1, -64);
  EXPECT_NEAR(degrees(state().position_rad), 38, 1e-6);
  // Found home, the encoder is preset with the motor.
  make_ready();
  EXPECT_NEAR(state().position_rad, 0, 1e-9);
  EXPECT_THAT(controller_->heard(), Contains("!1PESET0"));
}

TEST_F(SixkVariants, PositionsArePresetAtHomeWhereTheControllerDoesNot) {
  start();
  open(std::string(testing::kArm) + "preset_at_home = true\n");
  make_ready();
  EXPECT_THAT(controller_->heard(), Contains("!1PSET0"));
}

TEST_F(SixkVariants, HomeTowardsHighOfAReversedAxis) {
  start();
  open(std::string(testing::kArm) + "reversed = true\nhome_towards = \"high\"\n");
  make_ready();
  // Up for the axis is down for the motor.
  EXPECT_THAT(controller_->heard(), Contains("!HOM1"));
  ASSERT_TRUE(go(30).has_value());
  ASSERT_TRUE(wait_until_still());
  EXPECT_EQ(controller_->position(1), -6000);
  controller_->press(1, false, true);
  EXPECT_TRUE(state().at_high_limit);
}

TEST_F(SixkVariants, TwoAxesDoNotDisturbEachOther) {
  start();
  std::string both = testing::kArm;
  both += R"([axis.leg]
number = 2
counts_per_deg = 100
max_velocity_deg_s = 100.0
max_acceleration_deg_s2 = 500.0
home_velocity_deg_s = 60.0
)";
  open(both);
  make_ready(0);
  make_ready(1);
  ASSERT_TRUE(go(60, 100, 500, 0).has_value());
  ASSERT_TRUE(go(-60, 100, 500, 1).has_value());
  EXPECT_THAT(controller_->heard(), AllOf(Contains("!GO1"), Contains("!GOX1")));
  ASSERT_TRUE(wait_until([&] { return controller_->position(2) < -1000; }));
  ASSERT_TRUE(axis(1).stop().has_value());
  EXPECT_THAT(controller_->heard(), Contains("!S01"));
  EXPECT_EQ(controller_->stops(1), 0);
  ASSERT_TRUE(wait_until_still(1));
  ASSERT_TRUE(wait_until_still(0));
  EXPECT_EQ(controller_->position(1), 12000);
  EXPECT_GT(controller_->position(2), -6000);
}

}  // namespace
}  // namespace rig::drivers::sixk
