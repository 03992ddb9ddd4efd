// Rotations, transforms and directions.
#include "core/geometry/vec.h"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "core/base/random.h"
#include "core/base/units.h"
#include "core/geometry/directions.h"
#include "tests/core/seed.h"

namespace rig::geometry {
namespace {

constexpr std::uint64_t kSeed = 30;

Vec3 random_direction(base::Random& random) {
  return normalized({random.normal(), random.normal(), random.normal()});
}

RigidTransform random_transform(base::Random& random) {
  return {rotation_from_axis_angle(random.uniform(0, base::kPi) * random_direction(random)),
          {random.normal(), random.normal(), random.normal()}};
}

double largest_difference(const Mat3& a, const Mat3& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.m.size(); ++i) largest = std::max(largest, std::abs(a.m[i] - b.m[i]));
  return largest;
}

TEST(Rotation, TurnsTheRightHandedWay) {
  const double quarter = base::kPi / 2;
  EXPECT_NEAR((rotation_x(quarter) * Vec3{0, 1, 0}).z, 1, 1e-15);
  EXPECT_NEAR((rotation_y(quarter) * Vec3{0, 0, 1}).x, 1, 1e-15);
  EXPECT_NEAR((rotation_z(quarter) * Vec3{1, 0, 0}).y, 1, 1e-15);
  for (const double angle : {0.1, 1.0, 3.0, -2.0}) {
    EXPECT_LT(largest_difference(rotation_x(angle), rotation_from_axis_angle({angle, 0, 0})), 1e-15);
    EXPECT_LT(largest_difference(rotation_y(angle), rotation_from_axis_angle({0, angle, 0})), 1e-15);
    EXPECT_LT(largest_difference(rotation_z(angle), rotation_from_axis_angle({0, 0, angle})), 1e-15);
  }
}

TEST(Rotation, AgreesWithOpenCvsRodrigues) {
  base::Random random(test::seed(kSeed));
  for (int i = 0; i < 500; ++i) {
    const Vec3 w = random.uniform(0, base::kPi) * random_direction(random);
    cv::Matx33d expected;
    cv::Rodrigues(cv::Vec3d(w.x, w.y, w.z), expected);
    const Mat3 rotation = rotation_from_axis_angle(w);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(rotation(r, c), expected(r, c), 1e-13);
    }
  }
}

TEST(Rotation, IsOrthogonalAndProper) {
  base::Random random(test::seed(kSeed + 1));
  for (int i = 0; i < 500; ++i) {
    const Mat3 r = rotation_from_axis_angle(random.uniform(-10, 10) * random_direction(random));
    EXPECT_LT(largest_difference(r * transposed(r), Mat3{}), 1e-14);
    EXPECT_NEAR(determinant(r), 1, 1e-14);
  }
}

TEST(Rotation, AxisAngleThereAndBack) {
  base::Random random(test::seed(kSeed + 2));
  for (int i = 0; i < 5000; ++i) {
    // Angles of every size, from far below the smallest that shows in a matrix to nearly half a turn.
    const double angle = i % 2 == 0 ? random.uniform(0, 3.1) : std::pow(10, random.uniform(-18, 0));
    const Vec3 w = angle * random_direction(random);
    const Vec3 again = axis_angle_from_rotation(rotation_from_axis_angle(w));
    EXPECT_LT(length(again - w), 1e-12) << "angle " << angle;
  }
}

TEST(Rotation, AxisAngleNearHalfATurn) {
  base::Random random(test::seed(kSeed + 3));
  for (int i = 0; i < 5000; ++i) {
    const double short_of = i % 5 == 0 ? 0.0 : std::pow(10, random.uniform(-16, -1));
    const Mat3 r = rotation_from_axis_angle((base::kPi - short_of) * random_direction(random));
    const Vec3 w = axis_angle_from_rotation(r);
    EXPECT_GE(length(w), 0);
    EXPECT_LE(length(w), base::kPi + 1e-12);
    // The axis is lost in rounding there: 2e-7 rad is 0.04 seconds of arc.
    EXPECT_LT(largest_difference(r, rotation_from_axis_angle(w)), 2e-7)
        << "short of half a turn by " << short_of;
  }
  // Exactly half a turn about the coordinate axes.
  for (const Mat3& r : {Mat3{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, Mat3{{-1, 0, 0, 0, 1, 0, 0, 0, -1}},
                        Mat3{{-1, 0, 0, 0, -1, 0, 0, 0, 1}}}) {
    EXPECT_LT(largest_difference(r, rotation_from_axis_angle(axis_angle_from_rotation(r))), 1e-15);
  }
}

TEST(RigidTransform, ChainsAndInverts) {
  base::Random random(test::seed(kSeed + 4));
  for (int i = 0; i < 500; ++i) {
    const RigidTransform a_from_b = random_transform(random);
    const RigidTransform b_from_c = random_transform(random);
    const Vec3 p{random.normal(), random.normal(), random.normal()};
    EXPECT_LT(length((a_from_b * b_from_c).point(p) - a_from_b.point(b_from_c.point(p))), 1e-13);
    EXPECT_LT(length(inverse(a_from_b).point(a_from_b.point(p)) - p), 1e-13);
    EXPECT_LT(length(a_from_b.direction(p) - (a_from_b.point(p) - a_from_b.point({}))), 1e-13);
  }
}

TEST(Directions, PolarThereAndBack) {
  base::Random random(test::seed(kSeed + 5));
  for (int i = 0; i < 2000; ++i) {
    const Vec3 d = random_direction(random);
    EXPECT_LT(length(direction_from_polar(polar_from_direction(d)) - d), 1e-14);
  }
  EXPECT_EQ(polar_from_direction({0, 0, 1}).theta_rad, 0);
  EXPECT_NEAR(polar_from_direction({0, 2, 0}).phi_rad, base::kPi / 2, 1e-15) << "azimuth from x towards y";
}

TEST(Directions, AnglesKeepTheirDigitsAtBothEnds) {
  base::Random random(test::seed(kSeed + 6));
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = random_direction(random);
    const Vec3 side = normalized(cross(a, random_direction(random)));
    const double tiny = std::pow(10, random.uniform(-12, -1));
    const Vec3 near = std::cos(tiny) * a + std::sin(tiny) * side;
    EXPECT_NEAR(angle_between(a, near) / tiny, 1, 1e-3) << tiny;
    EXPECT_NEAR(angle_between(a, -near), base::kPi - tiny, 1e-14);
  }
}

TEST(Directions, MirrorAndHalfVector) {
  base::Random random(test::seed(kSeed + 7));
  for (int i = 0; i < 500; ++i) {
    Vec3 d = random_direction(random);
    d.z = std::abs(d.z) + 0.01;
    d = normalized(d);
    const Vec3 half = half_vector(d, mirrored(d));
    EXPECT_LT(length(half - Vec3{0, 0, 1}), 1e-13) << "the normal halves an angle and its mirror image";
  }
}

}  // namespace
}  // namespace rig::geometry
