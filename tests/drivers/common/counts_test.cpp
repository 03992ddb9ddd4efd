#include "drivers/common/counts.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "core/base/units.h"

namespace rig::drivers {
namespace {

using base::ErrorCode;
using base::radians;

constexpr double kInf = std::numeric_limits<double>::infinity();

// 200 counts a degree, 10 degrees at count 0.
CountScale scale(bool reversed = false) {
  return {200 / radians(1), radians(10), reversed};
}

TEST(CountScale, GoesThereAndBack) {
  for (const bool reversed : {false, true}) {
    const CountScale s = scale(reversed);
    for (const int counts : {-123456, -1, 0, 1, 77, 2000000000}) {
      const auto back = s.counts(s.radians(counts));
      ASSERT_TRUE(back.has_value());
      EXPECT_EQ(*back, counts);
    }
  }
}

TEST(CountScale, ZeroAndDirection) {
  EXPECT_DOUBLE_EQ(scale().radians(0), radians(10));
  EXPECT_NEAR(scale().radians(200), radians(11), 1e-12);
  EXPECT_NEAR(scale(true).radians(200), radians(9), 1e-12);
  EXPECT_EQ(*scale().counts(radians(12)), 400);
  EXPECT_EQ(*scale(true).counts(radians(12)), -400);
}

TEST(CountScale, ADistanceKnowsNoZero) {
  EXPECT_EQ(*scale().distance(radians(2)), 400);
  EXPECT_EQ(*scale(true).distance(radians(2)), -400);
  EXPECT_EQ(*scale().away_from(1000, radians(-2)), 600);
  EXPECT_EQ(*scale(true).away_from(1000, radians(-2)), 1400);
  EXPECT_EQ(scale().away_from(2147483000, radians(10)).error().code, ErrorCode::bad_input);
  EXPECT_EQ(scale().distance(kInf).error().code, ErrorCode::bad_input);
  EXPECT_EQ(scale().away_from(0, std::nan("")).error().code, ErrorCode::bad_input);
}

TEST(CountScale, RoundsToTheNearestCount) {
  const CountScale one{1, 0, false};
  EXPECT_EQ(*one.counts(2.49), 2);
  EXPECT_EQ(*one.counts(2.5), 3);
  EXPECT_EQ(*one.counts(-2.5), -3);
  EXPECT_EQ(*one.counts(-2.49), -2);
  for (const double angle : {0.3, -7.7, 1000.5001}) {
    EXPECT_LE(std::abs(one.radians(*one.counts(angle)) - angle), 0.5);
  }
}

TEST(CountScale, RefusesWhatARegisterCannotHold) {
  const CountScale one{1, 0, false};
  EXPECT_EQ(*one.counts(2147483647.0), 2147483647);
  EXPECT_EQ(*one.counts(-2147483647.0), -2147483647);
  for (const double angle : {2147483648.0, -2147483648.0, kInf, -kInf, std::nan("")}) {
    const auto counts = one.counts(angle);
    ASSERT_FALSE(counts.has_value()) << angle;
    EXPECT_EQ(counts.error().code, ErrorCode::bad_input);
  }
}

TEST(CountScale, ARateIsNeverMoreThanAllowedAndNeverZero) {
  const CountScale one{1, 5, true};
  EXPECT_EQ(*one.rate(7.999), 7);
  EXPECT_EQ(*one.rate(-7.999), 7);
  EXPECT_EQ(*one.rate(0.01), 1);
  EXPECT_EQ(*one.rate(0), 1);
  EXPECT_EQ(one.rate(kInf).error().code, ErrorCode::bad_input);
  EXPECT_EQ(one.rate(std::nan("")).error().code, ErrorCode::bad_input);
  EXPECT_EQ(one.rate(3e9).error().code, ErrorCode::bad_input);
}

TEST(CountScale, ARateThatIsWholeButForItsConversionStaysWhole) {
  // 0.1 degrees a second at 200 counts a degree are 20 counts a second, or 19.999... in floating point.
  for (const int per_degree : {200, 137, 3600, 7}) {
    const CountScale s{per_degree / radians(1), 0, false};
    for (int degrees = 1; degrees < 200; ++degrees) {
      EXPECT_EQ(*s.rate(radians(degrees)), degrees * per_degree);
    }
  }
}

}  // namespace
}  // namespace rig::drivers
