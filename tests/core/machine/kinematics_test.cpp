// Nominal kinematics against what can be said without them.
#include "core/machine/kinematics.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/base/units.h"
#include "core/geometry/directions.h"
#include "tests/core/machine/rig_file.h"
#include "tests/core/seed.h"

namespace rig::machine {
namespace {

using base::degrees;
using base::kPi;
using base::radians;
using geometry::polar_from_direction;
using geometry::Vec3;

void expect_near(Vec3 a, Vec3 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Kinematics, AtZeroTheSampleFacesTheCamera) {
  const RigConfig rig = rig_with({});
  const auto pose = bench_from_sample(rig.carrier, {});
  expect_near(pose.translation, {0, 0, 0.0254}, 1e-15);
  expect_near(pose.direction({1, 0, 0}), {1, 0, 0}, 1e-15);
  expect_near(camera_in_bench(rig.camera), {0, 0, 1.2254}, 1e-12);
  const DirectionPair pair = directions_at_centre(rig, {0, 0, 0, radians(60)});
  expect_near(pair.exitant, {0, 0, 1}, 1e-15);
  expect_near(pair.incident,
              geometry::normalized(Vec3{std::sin(radians(60)), 0, std::cos(radians(60)) - 0.0254}), 1e-15);
}

// Pan carries tilt, tilt carries roll: followed by hand through quarter turns.
TEST(Kinematics, EachMotorCarriesTheNext) {
  const RigConfig rig = rig_with({});
  const double quarter = kPi / 2;
  const auto along = [&](JointAngles angles) {
    return bench_from_sample(rig.carrier, angles).direction({1, 0, 0});
  };
  expect_near(along({quarter, 0, 0, 0}), {0, 1, 0}, 1e-15);
  expect_near(along({quarter, quarter, 0, 0}), {0, 0, 1}, 1e-15);
  expect_near(along({quarter, quarter, quarter, 0}), {1, 0, 0}, 1e-15);
  // The normal: tilted forward it looks down, panned it looks to +x.
  const auto normal = [&](JointAngles angles) {
    return bench_from_sample(rig.carrier, angles).direction({0, 0, 1});
  };
  expect_near(normal({0, quarter, 0, 0}), {0, -1, 0}, 1e-15);
  expect_near(normal({0, 0, quarter, 0}), {1, 0, 0}, 1e-15);
  expect_near(normal({1.234, 0, 0, 0}), {0, 0, 1}, 1e-15);
}

TEST(Kinematics, ThePlaneStaysItsOffsetFromTheCommonPoint) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(50));
  for (int i = 0; i < 200; ++i) {
    const JointAngles angles{random.uniform(-3, 3), random.uniform(-1, 1), random.uniform(-1, 1), 1};
    const auto pose = bench_from_sample(rig.carrier, angles);
    expect_near(pose.translation, 0.0254 * pose.direction({0, 0, 1}), 1e-15);
    const auto rolled = bench_from_sample(rig.carrier, {angles[0] + 1, angles[1], angles[2], 1});
    expect_near(rolled.translation, pose.translation, 1e-15);
  }
}

TEST(Kinematics, TheLightCirclesThePanAxis) {
  const RigConfig rig = rig_with({});
  expect_near(light_in_bench(rig.light, {0, 0, 0, 0}), {0, 0, 1}, 1e-15);
  expect_near(light_in_bench(rig.light, {1, 1, 1, kPi / 2}), {1, 0, 0}, 1e-15);
}

// With the sample plane in the axes, all in the plane of the bench: the polar angles are differences of
// angles.
TEST(Kinematics, InPlaneAnglesAreDifferences) {
  const RigConfig rig = rig_with({{"plane_offset_mm = 25.4", "plane_offset_mm = 0.0"}});
  base::Random random(test::seed(51));
  for (int i = 0; i < 500; ++i) {
    const double pan = random.uniform(-1.4, 1.4);
    const double arm = random.uniform(0.2, 3);
    const double roll = random.uniform(-3, 3);
    const auto pair = directions_at_centre(rig, {roll, 0, pan, arm});
    EXPECT_NEAR(polar_from_direction(pair.exitant).theta_rad, std::abs(pan), 1e-7);
    EXPECT_NEAR(polar_from_direction(pair.incident).theta_rad, std::abs(std::remainder(arm - pan, 2 * kPi)),
                1e-7);
    EXPECT_NEAR(geometry::angle_between(pair.incident, pair.exitant), arm, 1e-12);
  }
  // Specular: the normal halves the angle, and the view is the mirror image of the light.
  const auto specular = directions_at_centre(rig, {0.3, 0, radians(35), radians(70)});
  expect_near(geometry::mirrored(specular.incident), specular.exitant, 1e-12);
}

TEST(Kinematics, TiltIsThePolarAngleOfTheViewAndRollTurnsAzimuths) {
  const RigConfig rig = rig_with({{"plane_offset_mm = 25.4", "plane_offset_mm = 0.0"}});
  for (const double tilt_deg : {-60.0, -10.0, 25.0, 70.0}) {
    const auto pair = directions_at_centre(rig, {0, radians(tilt_deg), 0, 1});
    EXPECT_NEAR(degrees(polar_from_direction(pair.exitant).theta_rad), std::abs(tilt_deg), 1e-9);
    const auto rolled = directions_at_centre(rig, {0.4, radians(tilt_deg), 0, 1});
    for (const auto& [before, after] :
         {std::pair(pair.incident, rolled.incident), std::pair(pair.exitant, rolled.exitant)}) {
      EXPECT_NEAR(
          std::remainder(polar_from_direction(before).phi_rad - polar_from_direction(after).phi_rad - 0.4,
                         2 * kPi),
          0, 1e-12);
    }
  }
}

// Mirroring the bench in its plane changes the sign of tilt and roll and nothing that an isotropic material
// could tell.
TEST(Kinematics, TheBenchIsItsOwnMirrorImage) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(52));
  for (int i = 0; i < 200; ++i) {
    const JointAngles angles{random.uniform(-3, 3), random.uniform(-1, 1), random.uniform(-1, 1),
                             random.uniform(0.2, 3)};
    const auto a = directions_at_centre(rig, angles);
    const auto b = directions_at_centre(rig, {-angles[0], -angles[1], angles[2], angles[3]});
    expect_near({a.incident.x, -a.incident.y, a.incident.z}, b.incident, 1e-12);
    expect_near({a.exitant.x, -a.exitant.y, a.exitant.z}, b.exitant, 1e-12);
  }
}

TEST(SampleOutline, HasItsCornersWhereTheyAreSeen) {
  const RigConfig rig = rig_with({{"k1 = -0.12", "k1 = 0.0"},
                                  {"k2 = 0.05", "k2 = 0.0"},
                                  {"p1 = 0.0004", "p1 = 0.0"},
                                  {"p2 = -0.0003", "p2 = 0.0"}});
  const auto outline = sample_outline(rig, {});
  ASSERT_TRUE(outline.has_value());
  ASSERT_EQ(outline->size(), 4U);
  // 80 mm at 1.2 m with 6000 pixels of focal length are 400 pixels; the sample's y points up in the image.
  const double signs[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR((*outline)[i].x, 803.2 + 400 * signs[i][0], 1e-9);
    EXPECT_NEAR((*outline)[i].y, 596.4 + 400 * signs[i][1], 1e-9);
  }
}

TEST(SampleOutline, NothingWhereACornerIsBehindTheCamera) {
  const RigConfig rig = rig_with({{"position_mm = [0.0, 0.0, 1225.4]", "position_mm = [0.0, 0.0, 60.0]"},
                                  {"camera_radius_mm = 90.0", "camera_radius_mm = 1.0"},
                                  {"first = \"light\"\nsecond = \"carrier\"\nclearance_mm = 50.0",
                                   "first = \"light\"\nsecond = \"carrier\"\nclearance_mm = 0.0"}});
  EXPECT_TRUE(sample_outline(rig, {}).has_value());
  EXPECT_FALSE(sample_outline(rig, {0, 0, radians(80), 1}).has_value());
}

}  // namespace
}  // namespace rig::machine
