// rig.toml: the shipped file loads, and every mistake is found where it stands.
#include "core/machine/rig_config.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "tests/core/machine/rig_file.h"

namespace rig::machine {
namespace {

using base::radians;
using testing::ElementsAre;
using testing::HasSubstr;

// The line of `text` that holds `part`, counted from 1.
long line_of(const std::string& text, const std::string& part) {
  const auto at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
}

std::string complaints(const Changes& changes) {
  const auto rig = parse_rig_config(changed_rig_text(changes), "rig.toml");
  if (rig) return "no complaint";
  EXPECT_EQ(rig.error().code, base::ErrorCode::bad_input);
  return rig.error().text();
}

TEST(RigConfig, TheShippedFileLoads) {
  const auto rig = load_rig_config(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  ASSERT_TRUE(rig.has_value()) << rig.error().text();
  EXPECT_EQ(rig->name, "virtual rig");
  EXPECT_EQ(rig->clock, ClockKind::discrete_event);
  ASSERT_EQ(rig->modules.size(), 1U);
  EXPECT_EQ(rig->modules[0].name, "virtual");
  const AxisConfig& tilt = rig->axes[1];
  EXPECT_EQ(tilt.device.device, "tilt");
  EXPECT_DOUBLE_EQ(tilt.min_rad, radians(-75));
  EXPECT_DOUBLE_EQ(tilt.settle_s, 0.3);
  EXPECT_THAT(rig->home_order, ElementsAre(3, 1, 2, 0));
  EXPECT_EQ(rig->camera.bayer, geometry::BayerPattern::rggb);
  EXPECT_DOUBLE_EQ(rig->camera.min_exposure_s, 50e-6);
  EXPECT_DOUBLE_EQ(rig->light.arm_radius_m, 1);
  EXPECT_EQ(rig->carrier.fiducials.size(), 20U);
  EXPECT_EQ(rig->carrier.patches.size(), 4U);
  EXPECT_EQ(rig->lines.emergency_stop->line, "emergency_stop");
  EXPECT_EQ(rig->keep_out.size(), 2U);
}

TEST(RigConfig, TheCopyOfAScanReadsLikeTheFile) {
  const auto rig = parse_rig_config(shipped_rig_text(), "journal");
  ASSERT_TRUE(rig.has_value());
  EXPECT_EQ(rig->axes[3].home_rad, radians(45));
  EXPECT_EQ(rig->modules[0].settings.integer("seed", 0, 9), 1) << "left for the module to read";
}

TEST(RigConfig, CallsHaveDeadlinesAndMovingAxesATolerance) {
  const RigConfig usual = rig_with({});
  EXPECT_EQ(usual.deadlines.axis_s, 1);
  EXPECT_EQ(usual.deadlines.frame_s, 30);
  EXPECT_DOUBLE_EQ(usual.axes[2].following_rad, radians(5));
  const RigConfig rig = rig_with({{"[bodies]", "[deadlines]\naxis_ms = 250\nlines_ms = 400\n\n[bodies]"},
                                  {"home_deg = 0.0", "home_deg = 0.0\nfollowing_deg = 2.5"}});
  EXPECT_DOUBLE_EQ(rig.deadlines.axis_s, 0.25);
  EXPECT_DOUBLE_EQ(rig.deadlines.lines_s, 0.4);
  EXPECT_EQ(rig.deadlines.camera_s, 2);
  EXPECT_DOUBLE_EQ(rig.axes[0].following_rad, radians(2.5));
  EXPECT_THAT(complaints({{"[bodies]", "[deadlines]\naxis_ms = 0\naxes_ms = 1\n\n[bodies]"}}),
              ::testing::AllOf(HasSubstr("deadlines.axis_ms"), HasSubstr("axes_ms")));
}

TEST(RigConfig, UnknownKeysAreErrorsWithTheirPlace) {
  const std::string text = changed_rig_text({{"jog_velocity_deg_s = 10.0", "jog_velocty_deg_s = 10.0"}});
  const auto rig = parse_rig_config(text, "rig.toml");
  ASSERT_FALSE(rig.has_value());
  EXPECT_THAT(rig.error().text(),
              HasSubstr(fmt::format("rig.toml:{}:1: axis.arm.jog_velocty_deg_s: unknown key (did you mean "
                                    "'jog_velocity_deg_s'?)",
                                    line_of(text, "jog_velocty"))));
}

struct Mistake {
  const char* from;
  const char* to;
  const char* place;  ///< what the message says besides the line

  // NOLINTNEXTLINE(readability-identifier-naming): GoogleTest looks for this name.
  friend void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.to; }
};

class RigConfigMistakes : public testing::TestWithParam<Mistake> {};

// Each line of the shipped file that is changed yields an error that names that line and key.
TEST_P(RigConfigMistakes, AreFoundAtTheirLine) {
  const Mistake& mistake = GetParam();
  const std::string text = changed_rig_text({{mistake.from, mistake.to}});
  const auto rig = parse_rig_config(text, "rig.toml");
  ASSERT_FALSE(rig.has_value()) << mistake.to;
  EXPECT_EQ(rig.error().code, base::ErrorCode::bad_input);
  EXPECT_THAT(rig.error().text(), HasSubstr(fmt::format("rig.toml:{}:", line_of(text, mistake.to))));
  EXPECT_THAT(rig.error().text(), HasSubstr(mistake.place));
}

INSTANTIATE_TEST_SUITE_P(
    Every, RigConfigMistakes,
    testing::Values(
        Mistake{"max_deg = 75.0", "max_deg = -75.0", "axis.tilt.max_deg: must be greater than min_deg"},
        Mistake{"max_deg = 175.0", "max_deg = 9.0", "axis.arm.max_deg: must be greater"},
        Mistake{"max_deg = 180.0", "max_deg = nan", "axis.roll.max_deg: must be a number"},
        Mistake{"home_deg = 45.0", "home_deg = 176.0", "axis.arm.home_deg: lies outside"},
        Mistake{"approach_deg = 1.0", "approach_deg = 36.0", "axis.arm.approach_deg: from home_deg down"},
        Mistake{"max_velocity_deg_s = 20.0", "max_velocity_deg_s = 0.0",
                "axis.arm.max_velocity_deg_s: is 0, outside"},
        Mistake{"jog_velocity_deg_s = 10.0", "jog_velocity_deg_s = 21.0",
                "must not exceed max_velocity_deg_s"},
        Mistake{"tolerance_deg = 0.001", "tolerance_deg = -0.001", "axis.arm.tolerance_deg"},
        Mistake{"order = [\"arm\", \"tilt\", \"pan\", \"roll\"]",
                "order = [\"arm\", \"tilt\", \"pan\", \"arm\"]", "home.order: must name"},
        Mistake{"order = [\"arm\", \"tilt\", \"pan\", \"roll\"]", "order = [\"arm\", \"tilt\", \"pan\"]",
                "home.order: must name"},
        Mistake{"order = [\"arm\", \"tilt\", \"pan\", \"roll\"]",
                "order = [\"arm\", \"tilt\", \"pan\", \"lens\"]", "home.order: must name"},
        Mistake{"saturation_dn = 4095.0", "saturation_dn = 4096.0", "camera.saturation_dn: is 4096, outside"},
        Mistake{"saturation_dn = 4095.0", "saturation_dn = 60.0", "must be greater than black_dn"},
        Mistake{"bayer = \"RGGB\"", "bayer = \"RGBG\"", "camera.bayer: is 'RGBG' (one of"},
        Mistake{"max_exposure_us = 2000000", "max_exposure_us = 49", "is less than min_exposure_us"},
        Mistake{"white_balance = [1.6, 1.0, 1.4]", "white_balance = [1.6, 1.0]", "camera.white_balance"},
        Mistake{"position_mm = [0.0, 0.0, 1225.4]", "position_mm = [0.0, 900.0, 0.0]", "vertical"},
        Mistake{"tag_family = \"tag36h11\"", "tag_family = \"tag16h5\"", "carrier.tag_family: is 'tag16h5'"},
        Mistake{"reflectance = 0.5", "reflectance = 1.5", "carrier.patch[0].reflectance"},
        Mistake{"carrier_radius_mm = 155.0", "carrier_radius_mm = 140.0", "does not reach around fiducial"},
        Mistake{"second = \"camera\"", "second = \"light\"", "must be another body"},
        Mistake{"second = \"camera\"", "second = \"lens\"", "keep_out[0].second: is 'lens'"},
        Mistake{"name = \"light and carrier\"", "name = \"light and camera\" # again", "a second rule named"},
        Mistake{"clearance_mm = 30.0", "clearance_mm = -1.0", "keep_out[0].clearance_mm"},
        Mistake{"clock = \"discrete-event\"", "clock = \"fast\"", "clock: is 'fast'"},
        Mistake{"module = \"virtual\"\ndevice = \"camera\"", "module = \"other\"\ndevice = \"camera\"",
                "camera.module: no [[module]] is named 'other'"},
        Mistake{"line = \"emergency_stop\"", "line = 3", "lines.emergency_stop.line: must be a text"},
        Mistake{"width = 1600", "width = 1600.5", "camera.width: must be a whole number"}));

TEST(RigConfig, FiducialsMustBeAtLeastFourWithDifferentIds) {
  EXPECT_THAT(complaints({{"[19, 95.0, -95.0", "[18, 95.0, -95.0"}}), HasSubstr("id 18 stands twice"));
  EXPECT_THAT(complaints({{"[19, 95.0, -95.0", "[587, 95.0, -95.0"}}), HasSubstr("587 is no tag36h11 id"));
  EXPECT_THAT(complaints({{"[19, 95.0, -95.0", "[1.5, 95.0, -95.0"}}), HasSubstr("1.5 is no tag36h11 id"));
  EXPECT_THAT(complaints({{"[19, 95.0, -95.0", "[1e300, 95.0, -95.0"}}), HasSubstr("is no tag36h11 id"));
  EXPECT_THAT(complaints({{"[0, -95.0, 95.0, 18.0, 0.0]", "[0, -95.0, 95.0, 18.0]"}}),
              HasSubstr("must be 5 numbers"));
  std::string few = shipped_rig_text();
  const auto begin = few.find("  [3, 33.0");
  const auto end = few.find("]\n\n[[carrier.patch]]", begin);
  few.erase(begin, end - begin);
  const auto rig = parse_rig_config(few, "rig.toml");
  ASSERT_FALSE(rig.has_value());
  EXPECT_THAT(rig.error().text(), HasSubstr("has 3 usable tags, at least 4 are needed"));
}

TEST(RigConfig, NoPatchNoScale) {
  std::string none = shipped_rig_text();
  const auto begin = none.find("[[carrier.patch]]");
  none.erase(begin, none.find("[bodies]") - begin);
  const auto rig = parse_rig_config(none, "rig.toml");
  ASSERT_FALSE(rig.has_value());
  EXPECT_THAT(rig.error().text(), HasSubstr("carrier.patch: is missing"));
}

TEST(RigConfig, TwoAxesOnOneDevice) {
  EXPECT_THAT(complaints({{"device = \"pan\"", "device = \"tilt\""}}),
              HasSubstr("axis.tilt and axis.pan are both device 'tilt' of module 'virtual'"));
}

TEST(RigConfig, LimitsOfZeroAreNotNoLimits) {
  EXPECT_THAT(
      complaints({{"min_deg = -180.0", "min_deg = 0"}, {"max_deg = 180.0", "max_deg = 0"}}),
      HasSubstr("axis.roll.max_deg: must be greater than min_deg (equal limits do not mean 'no limits')"));
}

TEST(RigConfig, HomeMustBeAllowed) {
  EXPECT_THAT(complaints({{"clearance_mm = 50.0", "clearance_mm = 900.0"}}),
              HasSubstr("the rig may not stand at home: keep-out 'light and carrier'"));
}

TEST(RigConfig, EveryMistakeIsReportedAtOnce) {
  const std::string text = complaints({{"settle_ms = 300", "settle_ms = \"long\""},
                                       {"width = 1600", "wdith = 1600"},
                                       {"reflectance = 0.5", "reflectance = 0.0"}});
  EXPECT_THAT(text, HasSubstr("axis.roll.settle_ms: must be a number"));
  EXPECT_THAT(text, HasSubstr("camera.width: is missing"));
  EXPECT_THAT(text, HasSubstr("camera.wdith: unknown key (did you mean 'width'?)"));
  EXPECT_THAT(text, HasSubstr("carrier.patch[0].reflectance"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3) << "a line each:\n" << text;
}

TEST(RigConfig, AFileOfANewerVersionIsRefusedAsSuch) {
  for (const char* format : {"format = 2", "format = 9223372036854775807"}) {
    // Also where it holds keys that this version does not know.
    const auto rig = parse_rig_config(
        changed_rig_text({{"format = 1", format}, {"[home]", "[of_the_future]\nx = 1\n[home]"}}), "rig.toml");
    ASSERT_FALSE(rig.has_value());
    EXPECT_EQ(rig.error().code, base::ErrorCode::newer);
    EXPECT_THAT(rig.error().text(), HasSubstr("rig.toml:3:10: format"));
  }
  EXPECT_THAT(complaints({{"format = 1\n", ""}}), HasSubstr("format: is missing"));
  EXPECT_THAT(complaints({{"format = 1", "format = 0"}}), HasSubstr("format: is 0, outside"));
}

TEST(RigConfig, TheCameraLooksWhereItIsTold) {
  const RigConfig nominal = rig_with({});
  const geometry::Mat3 expected{{1, 0, 0, 0, -1, 0, 0, 0, -1}};
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(nominal.camera.camera_from_bench.rotation.m[i], expected.m[i], 1e-15);
  }
  const RigConfig aside =
      rig_with({{"position_mm = [0.0, 0.0, 1225.4]",
                 "position_mm = [300.0, 200.0, 1100.0]\nlook_at_mm = [10.0, -20.0, 5.0]"}});
  const auto& pose = aside.camera.camera_from_bench;
  const geometry::Vec3 target = pose.point({0.010, -0.020, 0.005});
  EXPECT_NEAR(target.x, 0, 1e-12);
  EXPECT_NEAR(target.y, 0, 1e-12);
  EXPECT_NEAR(target.z, std::hypot(0.29, 0.22, 1.095), 1e-12);
  EXPECT_NEAR(geometry::determinant(pose.rotation), 1, 1e-14);
  EXPECT_NEAR(pose.direction({0, 1, 0}).x, 0, 1e-12) << "the bench's vertical is vertical in the image";
  EXPECT_LT(pose.direction({0, 1, 0}).y, 0) << "and up";
}

}  // namespace
}  // namespace rig::machine
