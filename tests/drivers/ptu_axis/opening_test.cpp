// How a unit is found, set up and found again.
#include <gmock/gmock.h>

#include "tests/drivers/ptu_axis/unit_fixture.h"

namespace rig::drivers::ptu {
namespace {

using base::ErrorCode;
using base::radians;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class PtuOpening : public testing::UnitTest {};

TEST_F(PtuOpening, SetsTheUnitUp) {
  start();
  open();
  const auto heard = unit_->heard();
  // Halted before anything else is said; the second time it surely stands alone in its line.
  ASSERT_GE(heard.size(), 4U);
  EXPECT_EQ(heard[0], "H");
  EXPECT_EQ(heard[1], "H");
  for (const char* command :
       {"ED", "FT", "PR", "TR", "CI", "I", "LE", "PN", "PX", "TN", "TX", "PL", "PU", "TL", "TU"}) {
    EXPECT_THAT(heard, Contains(command));
  }
  // 240 deg/s^2 and 200 deg/s^2 in whole steps, rounded down.
  EXPECT_THAT(heard, Contains("PA4666"));
  EXPECT_THAT(heard, Contains("TA3888"));
  // Opened again it has them already.
  unit_->forget_heard();
  open();
  EXPECT_THAT(unit_->heard(), AllOf(Not(Contains("PA4666")), Not(Contains("TA3888"))));
}

TEST_F(PtuOpening, TellsWhatTheUnitIsCapableOf) {
  start();
  open(R"(
[axis.pan]
max_velocity_deg_s = 1000
max_acceleration_deg_s2 = 240
)");
  ASSERT_EQ(devices_.size(), 1U);
  EXPECT_EQ(devices_[0].name, "pan");
  EXPECT_EQ(devices_[0].bus, "ptu");
  const AxisCapabilities can = pan().capabilities();
  EXPECT_NEAR(can.resolution_rad, radians(185.1428 / 3600), 1e-12);
  // Its upper speed limit is 2902 steps a second.
  EXPECT_NEAR(can.max_velocity_rad_s, radians(2902 / testing::kStepsPerDegree), 1e-9);
  EXPECT_NEAR(can.max_acceleration_rad_s2, radians(240), 1e-12);
  EXPECT_FALSE(can.keeps_position_unpowered);
}

TEST_F(PtuOpening, EitherAxisMayBeLeftOut) {
  start();
  open("[axis.tilt]\nmax_velocity_deg_s = 40.0\nmax_acceleration_deg_s2 = 200.0\n");
  ASSERT_EQ(devices_.size(), 1U);
  EXPECT_EQ(devices_[0].name, "tilt");
  EXPECT_THAT(unit_->heard(), AllOf(Contains("TR"), Not(Contains("PR"))));
}

TEST_F(PtuOpening, TheOwnersScaleHasToAgree) {
  start();
  const std::string rest = "max_velocity_deg_s = 60\nmax_acceleration_deg_s2 = 240\n";
  open("[axis.pan]\ncounts_per_deg = 19.44\n" + rest);
  const auto opened = try_open("[axis.pan]\ncounts_per_deg = 19.4\n" + rest);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::bad_input);
  EXPECT_THAT(opened.error().text(),
              AllOf(HasSubstr("rig.toml"), HasSubstr("counts_per_deg"), HasSubstr("19.444")));
}

TEST_F(PtuOpening, AUnitThatIsSilentIsLost) {
  sim::wire::Pty nobody(folder_ / "nobody");
  const test::SettingsAtPort settings(&open_devices,
                                      std::string("answer_ms = 20\nreset_s = 1\n") + testing::kBothAxes,
                                      nobody.path(), folder_);
  const auto opened = settings.open(*clock_);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::lost);
  EXPECT_THAT(opened.error().text(), HasSubstr("switched on"));
  // It was told to halt all the same.
  std::string heard;
  EXPECT_TRUE(wait_until([&] {
    heard += nobody.read(std::chrono::milliseconds(10));
    return heard.find("H ") != std::string::npos;
  })) << heard;
}

TEST_F(PtuOpening, ALineThatIsNotThereIsLostAtOnce) {
  start();
  unit_->cut();
  const auto began = clock_->now();
  const auto opened = try_open();
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, ErrorCode::lost);
  EXPECT_LT(clock_->now() - began, base::seconds(5));
}

TEST_F(PtuOpening, WaitsForAUnitThatResetsAtPowerUp) {
  Ptu::Setup setup;
  setup.resets_at_power_up = true;
  setup.halt_ends_reset = false;
  start(setup);
  open();
  // Its own reset is not ours: what it did before we came is not known.
  EXPECT_FALSE(state(pan()).homed);
}

TEST_F(PtuOpening, HaltsWhatNobodyWatchesAnyMore) {
  start();
  open();
  make_ready(pan());
  ASSERT_TRUE(go(pan(), 100).has_value());
  ASSERT_TRUE(wait_until([&] { return unit_->position(Ptu::pan) > 100; }));
  open();
  EXPECT_FALSE(unit_->moving(Ptu::pan));
  EXPECT_LT(unit_->position(Ptu::pan), 1500);
  EXPECT_FALSE(state(pan()).moving);
  EXPECT_FALSE(state(pan()).homed);
}

TEST_F(PtuOpening, UserLimits) {
  start();
  open(R"(limits = "user"
[axis.pan]
reversed = true
max_velocity_deg_s = 60
max_acceleration_deg_s2 = 240
user_min_deg = -20
user_max_deg = 60
)");
  const auto heard = unit_->heard();
  EXPECT_THAT(heard, Contains("PNU-1167"));
  EXPECT_THAT(heard, Contains("PXU389"));
  EXPECT_THAT(heard, AllOf(Contains("LU"), Not(Contains("LE"))));
  make_ready(pan());
  ASSERT_TRUE(go(pan(), 59).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(go(pan(), -21).error().code, ErrorCode::refused);
}

TEST_F(PtuOpening, LimitsMayBeSwitchedOff) {
  start();
  open(std::string("limits = \"off\"\n") + testing::kBothAxes);
  EXPECT_THAT(unit_->heard(), AllOf(Contains("LD"), Not(Contains("LE"))));
}

TEST_F(PtuOpening, ABaseSpeedIsSetOnce) {
  start();
  const std::string settings = R"(
[axis.pan]
max_velocity_deg_s = 60
max_acceleration_deg_s2 = 240
base_velocity_deg_s = 2
)";
  open(settings);
  EXPECT_EQ(times_heard("PB38"), 1U);
  open(settings);
  EXPECT_EQ(times_heard("PB38"), 1U);
}

TEST_F(PtuOpening, AnotherUnitAfterwardsIsAFault) {
  start();
  open();
  Ptu::Setup other;
  other.axes[Ptu::pan].resolution = "46.2857";
  start(other);
  base::Error said;
  EXPECT_TRUE(wait_until([&] {
    const auto now = pan().state();
    if (!now) said = now.error();
    return !now && now.error().code == ErrorCode::device;
  }));
  EXPECT_THAT(said.text(), HasSubstr("steps a degree"));
}

// Every manner of ending a line and of wording a resolution that units are known for.
struct Manner {
  const char* name;
  const char* line_end;
  const char* resolution;
  const char* words;
};

class PtuManners : public testing::UnitTest, public ::testing::WithParamInterface<Manner> {};

TEST_P(PtuManners, AreUnderstood) {
  Ptu::Setup setup;
  setup.line_end = GetParam().line_end;
  setup.resolution_words = GetParam().words;
  for (auto& axis : setup.axes) axis.resolution = GetParam().resolution;
  start(setup);
  open("[axis.pan]\nmax_velocity_deg_s = 5\nmax_acceleration_deg_s2 = 50\n");
  const double step_deg = std::stod(GetParam().resolution) / 3600;
  EXPECT_NEAR(pan().capabilities().resolution_rad, radians(step_deg), 1e-12);
  make_ready(pan());
  ASSERT_TRUE(go(pan(), 3, 5, 50).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(unit_->position(Ptu::pan), std::round(3 / step_deg));
  EXPECT_NEAR(state(pan()).position_rad, radians(3), radians(step_deg));
}

INSTANTIATE_TEST_SUITE_P(Units, PtuManners,
                         ::testing::Values(Manner{"d46", "\r\n", "185.1428", " seconds arc per Pan position"},
                                           Manner{"d300", " \r\n", "92.5714", " seconds arc per position"},
                                           Manner{"gear46", "\r", "46.2857", " seconds arc per position"},
                                           Manner{"gear108", "\n", "108.0", " seconds arc per position"},
                                           Manner{"whole", "\r\n", "108", " seconds arc per position"}),
                         [](const auto& each) { return each.param.name; });

}  // namespace
}  // namespace rig::drivers::ptu
