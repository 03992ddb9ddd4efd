// The longest bracket of each strategy.
#include "core/machine/exposure_bounds.h"

#include <gtest/gtest.h>

#include "core/base/units.h"
#include "tests/core/machine/rig_file.h"

namespace rig::machine {
namespace {

const JointAngles kPose{0, base::radians(20.0), 0, base::radians(60.0)};

void expect_most(const ExposureConfig& exposure, int frames, double bracket_s) {
  EXPECT_EQ(most_frames(exposure), frames);
  EXPECT_NEAR(longest_bracket_s(rig_with({}), exposure, kPose), bracket_s, 1e-12);
}

TEST(ExposureBounds, AreTheSumOfAFixedBracket) {
  ExposureConfig exposure;
  exposure.exposures_s = {0.5, 0.125, 0.01};
  expect_most(exposure, 3, 0.635);
}

TEST(ExposureBounds, OfHalvingAreEveryHalfOfTheLongest) {
  ExposureConfig exposure;
  exposure.strategy = ExposureStrategy::halve;
  exposure.longest_s = 0.4;
  exposure.most_frames = 3;
  expect_most(exposure, 3, 0.4 + 0.2 + 0.1);
  exposure.most_frames = 1;
  expect_most(exposure, 1, 0.4);
}

TEST(ExposureBounds, OfAdaptingAreTheFirstAndElseTheLongest) {
  ExposureConfig exposure;
  exposure.strategy = ExposureStrategy::adaptive;
  exposure.first_s = 0.02;
  exposure.longest_s = 1.5;
  exposure.most_frames = 5;
  expect_most(exposure, 5, 0.02 + 4 * 1.5);
}

TEST(ExposureBounds, OfAPredictedBracketDependOnThePose) {
  ExposureConfig exposure;
  exposure.strategy = ExposureStrategy::predicted;
  exposure.lightest_s = {0.2, 0.02};
  exposure.darkest_s = {2, 0.2};
  exposure.lightest_rad = base::radians(170.0);  // lighter than any pose: the lightest bracket
  exposure.darkest_rad = base::radians(175.0);
  expect_most(exposure, 2, 0.22);
  exposure.lightest_rad = -2e-9;
  exposure.darkest_rad = -1e-9;
  expect_most(exposure, 2, 2.2);
}

}  // namespace
}  // namespace rig::machine
