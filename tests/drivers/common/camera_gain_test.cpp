// A camera's gain in its own numbers.
#include "drivers/common/camera_gain.h"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

namespace rig::drivers {
namespace {

using testing::HasSubstr;

TEST(CameraGain, GoesToTheCamerasNumberAndBack) {
  EXPECT_DOUBLE_EQ(gain_value({}, 1), 0);
  EXPECT_NEAR(gain_value({}, 2), 6.0206, 1e-4);
  EXPECT_NEAR(gain_value({GainUnit::decibel, 10, 5}, 2), 5 + 60.206, 1e-3);
  EXPECT_DOUBLE_EQ(gain_value({GainUnit::factor, 10, 5}, 2.5), 30);
  for (const GainUnit unit : {GainUnit::decibel, GainUnit::factor}) {
    const GainScale scale{unit, 10, 5};
    for (const double factor : {0.5, 1.0, 3.7}) {
      EXPECT_NEAR(gain_factor(scale, gain_value(scale, factor)), factor, 1e-12);
    }
    for (const double none : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
      EXPECT_TRUE(std::isnan(gain_value(scale, none)));
    }
  }
}

TEST(CameraGain, IsSaidInTwoKeys) {
  const auto said = [](const std::string& text) { return base::ConfigTable::parse(text, "rig.toml"); };
  const auto table = said("gain_unit = \"factor\"\ngain_counts = 16");
  ASSERT_TRUE(table.has_value());
  EXPECT_EQ(read_gain_scale(*table), (GainScale{GainUnit::factor, 16, 0}));
  EXPECT_EQ(read_gain_scale(*said("")), GainScale{});
  const auto wrong = said("gain_unit = \"bel\"\ngain_counts = 0");
  (void)read_gain_scale(*wrong);
  ASSERT_FALSE(wrong->noted().has_value());
  EXPECT_THAT(wrong->noted().error().text(), HasSubstr("gain_unit"));
  EXPECT_THAT(wrong->noted().error().text(), HasSubstr("gain_counts"));
}

}  // namespace
}  // namespace rig::drivers
