// Two images of the same pose: what moved between them.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/fiducials/compare.h"

namespace rig::calibration {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Six tags around (200, 150), seen by a camera shifted and turned about (200, 150).
std::vector<TagSighting> tags(double dx, double dy, double turn_rad) {
  std::vector<TagSighting> out;
  for (int id = 0; id < 6; ++id) {
    TagSighting tag;
    tag.id = id;
    const double at = id * 1.1;
    const double x = 120 * std::cos(at);
    const double y = 90 * std::sin(at);
    for (std::size_t i = 0; i < 4; ++i) {
      const double cx = x + (i == 1 || i == 2 ? 5 : -5);
      const double cy = y + (i < 2 ? 5 : -5);
      tag.corners[i].x = 200 + dx + std::cos(turn_rad) * cx - std::sin(turn_rad) * cy;
      tag.corners[i].y = 150 + dy + std::sin(turn_rad) * cx + std::cos(turn_rad) * cy;
    }
    out.push_back(tag);
  }
  return out;
}

TEST(CompareFiducials, NothingMoved) {
  const FiducialShift shift = compare_fiducials(tags(0, 0, 0), tags(0.1, -0.1, 0.0001));
  EXPECT_EQ(shift.before, 6);
  EXPECT_EQ(shift.common, 6);
  EXPECT_THAT(what_moved(shift, {}), IsEmpty());
}

TEST(CompareFiducials, AShiftIsMeasuredAndNamed) {
  const FiducialShift shift = compare_fiducials(tags(0, 0, 0), tags(3, -4, 0));
  EXPECT_NEAR(shift.shift_px.x, 3, 1e-9);
  EXPECT_NEAR(shift.shift_px.y, -4, 1e-9);
  EXPECT_NEAR(shift.turn_rad, 0, 1e-12);
  EXPECT_THAT(what_moved(shift, {}), HasSubstr("5.0 pixels"));
  EXPECT_THAT(what_moved(shift, {6, 1}), IsEmpty());
}

TEST(CompareFiducials, ATurnAboutTheMiddleIsSeenThoughTheMedianTagBarelyMoves) {
  const FiducialShift shift = compare_fiducials(tags(0, 0, 0), tags(0, 0, 0.01));
  EXPECT_NEAR(shift.turn_rad, 0.01, 1e-9);
  EXPECT_THAT(what_moved(shift, {100, 0.003}), HasSubstr("turned by 0.57 deg"));
}

TEST(CompareFiducials, OneMisreadTagDoesNotCount) {
  auto after = tags(0, 0, 0);
  for (auto& corner : after[2].corners) corner.x += 80;
  EXPECT_THAT(what_moved(compare_fiducials(tags(0, 0, 0), after), {}), IsEmpty());
  after = tags(0, 0, 0);
  after.push_back(after[1]);
  const FiducialShift shift = compare_fiducials(tags(0, 0, 0), after);
  EXPECT_EQ(shift.common, 5) << "an id that is there twice says nothing";
}

TEST(CompareFiducials, AHiddenSampleIsNoUnmovedOne) {
  auto after = tags(0, 0, 0);
  after.resize(2);
  EXPECT_THAT(what_moved(compare_fiducials(tags(0, 0, 0), after), {}), HasSubstr("only 2 of 6"));
  EXPECT_THAT(what_moved(compare_fiducials(tags(0, 0, 0), {}), {}), HasSubstr("only 0 of 6"));
}

}  // namespace
}  // namespace rig::calibration
