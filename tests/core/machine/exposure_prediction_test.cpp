// Exposures from the angle to the highlight.
#include "core/machine/exposure_prediction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "tests/core/machine/rig_file.h"

namespace rig::machine {
namespace {

using base::radians;
using testing::DoubleNear;
using testing::ElementsAre;

ExposureConfig config() {
  ExposureConfig out;
  out.strategy = ExposureStrategy::predicted;
  out.lightest_s = {0.01, 0.001};
  out.darkest_s = {1.0, 0.064};
  out.lightest_rad = radians(10);
  out.darkest_rad = radians(70);
  return out;
}

TEST(PredictedBracket, IsTheGivenOneAtBothEndsAndBeyond) {
  for (const double deg : {0.0, 10.0}) {
    EXPECT_THAT(predicted_bracket_s(config(), radians(deg)), ElementsAre(0.01, 0.001));
  }
  for (const double deg : {70.0, 150.0}) {
    EXPECT_THAT(predicted_bracket_s(config(), radians(deg)), ElementsAre(1.0, 0.064));
  }
}

TEST(PredictedBracket, IsTheGeometricMeanHalfWay) {
  EXPECT_THAT(predicted_bracket_s(config(), radians(40)),
              ElementsAre(DoubleNear(0.1, 1e-12), DoubleNear(0.008, 1e-12)));
  EXPECT_NEAR(predicted_bracket_s(config(), radians(25))[0], 0.01 * std::pow(100, 0.25), 1e-12);
}

TEST(PredictedBracket, GrowsWithTheAngleAndStaysInOrder) {
  std::vector<double> before{0, 0};
  for (double deg = 0; deg < 90; deg += 0.37) {
    const auto bracket = predicted_bracket_s(config(), radians(deg));
    for (std::size_t i = 0; i < 2; ++i) EXPECT_GE(bracket[i], before[i]);
    EXPECT_GT(bracket[0], bracket[1]);
    before = bracket;
  }
}

TEST(MirrorAngle, IsZeroWhereTheCameraSeesTheHighlight) {
  const RigConfig rig = rig_with({});
  // The sample's normal half way between camera (at 0) and light: pan is half of the arm's angle.
  const double at_highlight = mirror_angle_rad(rig, {0, 0, radians(30), radians(60)});
  EXPECT_LT(base::degrees(at_highlight), 3) << "but for the offset of the sample from the axes";
  EXPECT_NEAR(base::degrees(mirror_angle_rad(rig, {0, 0, radians(10), radians(60)})), 40, 3);
  EXPECT_NEAR(mirror_angle_rad(rig, {radians(77), 0, radians(10), radians(60)}),
              mirror_angle_rad(rig, {0, 0, radians(10), radians(60)}), 1e-9)
      << "roll turns the sample in its plane";
}

}  // namespace
}  // namespace rig::machine
