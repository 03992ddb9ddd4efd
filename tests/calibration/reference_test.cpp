#include "calibration/reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/reflectance.h"
#include "tests/calibration/synthetic.h"

namespace rig::calibration {
namespace {

using geometry::Vec3;
using ::testing::HasSubstr;

RadianceImage ideal_image(const machine::RigConfig& rig, const std::vector<double>& signal) {
  RadianceImage image;
  image.rect = {0, 0, rig.camera.intrinsics.width, rig.camera.intrinsics.height};
  image.value.assign(signal.begin(), signal.end());
  image.variance.assign(signal.size(), 1.0F);
  image.saturated.assign(signal.size(), 0);
  return image;
}

TEST(Irradiance, IsCosineOverSquaredDistanceAtThePoint) {
  EXPECT_DOUBLE_EQ(irradiance_per_intensity({0, 0, 2}, {0, 0, 0}), 0.25);
  EXPECT_NEAR(irradiance_per_intensity({1, 0, 1}, {0, 0, 0}), std::sqrt(0.5) / 2, 1e-15);
  EXPECT_NEAR(irradiance_per_intensity({1, 0, 1}, {1, 0, 0}), 1, 1e-15);
  EXPECT_EQ(irradiance_per_intensity({1, 0, -0.1}, {0, 0, 0}), 0);
}

TEST(LightInSample, FollowsTheArmAndTheRegisteredCarrier) {
  const auto rig = testing::small_rig();
  // The carrier faces the camera with its centre on the axis, plane_offset in front of the common point.
  const geometry::RigidTransform camera_from_sample = testing::pose(0, 0, 0);
  const Vec3 straight = light_in_sample(rig, camera_from_sample, {0, 0, 0, 0});
  EXPECT_NEAR(straight.x, 0, 1e-12);
  EXPECT_NEAR(straight.y, 0, 1e-12);
  EXPECT_NEAR(straight.z, 1.0 - 0.0254, 1e-12);
  const Vec3 aside = light_in_sample(rig, camera_from_sample, {0, 0, 0, base::radians(90)});
  EXPECT_NEAR(aside.x, 1.0, 1e-12);
  EXPECT_NEAR(aside.z, -0.0254, 1e-12);
}

TEST(MeasurePatch, ReadsTheIntensityOfARenderedPatch) {
  const auto rig = testing::small_rig();
  const testing::Carrier carrier(rig, [](double, double) { return testing::Rgb{0.2, 0.1, 0.05}; });
  const auto pose = testing::pose(25, 45, -10);
  const Vec3 light{0.4, -0.2, 0.85};
  const Rgb intensity{20e3, 32e3, 23e3};
  const auto image = ideal_image(rig, testing::render(rig, carrier, pose, light, intensity, 2));
  for (std::size_t i = 0; i < rig.carrier.patches.size(); ++i) {
    const auto reading = measure_patch(image, rig.camera, pose, light, rig.carrier.patches[i], i);
    ASSERT_TRUE(reading) << reading.error().text();
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(reading->intensity[c] / intensity[c], 1, 5e-4);
    EXPECT_GT(reading->sigma[0], 0);
  }
}

TEST(MeasurePatch, RefusesWhatItCannotRead) {
  const auto rig = testing::small_rig();
  const auto pose = testing::pose(0, 0, 0);
  const Vec3 light{0.4, -0.2, 0.85};
  RadianceImage image = ideal_image(rig, std::vector<double>(640 * 480, 1.0));
  const auto& patch = rig.carrier.patches[0];
  EXPECT_TRUE(measure_patch(image, rig.camera, pose, light, patch, 0));
  EXPECT_THAT(measure_patch(image, rig.camera, pose, {0.4, 0, -1}, patch, 0).error().text(),
              HasSubstr("not lit"));
  const auto aside = testing::pose(0, 0, 0, {0, -0.02, 0});
  EXPECT_THAT(measure_patch(image, rig.camera, aside, light, patch, 2).error().text(),
              HasSubstr("patch 3: is not wholly in the image"));
  auto speck = patch;
  speck.width_m = speck.height_m = 0.001;
  EXPECT_THAT(measure_patch(image, rig.camera, pose, light, speck, 1).error().text(), HasSubstr("pixels"));
  const auto box = pixels_of_patch(rig.camera.intrinsics, pose, patch);
  image.saturated[image.index(box.x + box.width / 2, box.y + box.height / 2)] = 1;
  EXPECT_THAT(measure_patch(image, rig.camera, pose, light, patch, 0).error().text(), HasSubstr("saturated"));
}

constexpr std::uint64_t kSeed = 31;

// Readings of a light whose intensity varies from pose to pose and patch to patch by these relative amounts.
std::vector<std::vector<PatchReading>> readings(std::size_t poses, double between, double within,
                                                std::vector<double>* truth, std::uint64_t seed) {
  base::Random random(seed);
  std::vector<std::vector<PatchReading>> out(poses);
  truth->clear();
  for (auto& pose : out) {
    const double light = between * random.normal();
    truth->push_back(std::exp(light));
    for (std::size_t i = 0; i < 4; ++i) {
      const double x = std::exp(light + within * random.normal());
      pose.push_back({i, {100 * x, 200 * x, 300 * x}, {1e-3, 1e-3, 1e-3}});
    }
  }
  return out;
}

TEST(PoolReadings, AStableLightGivesOneScaleAndADriftingOneFollows) {
  std::vector<double> truth;
  double pooled_error = 0, own_error = 0;
  for (std::uint64_t trial = 0; trial < 50; ++trial) {
    const auto stable = readings(60, 0, 0.01, &truth, base::derive_key(kSeed, trial));
    const auto scale = pool_readings(stable);
    ASSERT_TRUE(scale);
    for (std::size_t p = 0; p < truth.size(); ++p) {
      const double mean = (stable[p][0].intensity[1] + stable[p][1].intensity[1] + stable[p][2].intensity[1] +
                           stable[p][3].intensity[1]) /
                          4;
      pooled_error += std::pow(scale->intensity[p][1] / 200 - 1, 2);
      own_error += std::pow(mean / 200 - 1, 2);
    }
  }
  // Pooling sixty poses of a stable light must beat each pose's own patches clearly.
  std::cout << "seed " << kSeed << ": pooled over own " << std::sqrt(pooled_error / own_error) << '\n';
  EXPECT_LT(std::sqrt(pooled_error / own_error), 0.4);

  const auto drifting = readings(60, 0.05, 0.002, &truth, kSeed);
  const auto scale = pool_readings(drifting);
  ASSERT_TRUE(scale);
  for (std::size_t p = 0; p < truth.size(); ++p)
    EXPECT_NEAR(scale->intensity[p][2] / 300 / truth[p], 1, 0.005);
  EXPECT_NEAR(scale->between_poses[0], 0.05, 0.02);
  EXPECT_NEAR(scale->between_patches[0], 0.002, 0.0006);
}

// The stated error of a pose's scale is the spread of many scans, from a stable light to a drifting one.
TEST(PoolReadings, StatedErrorIsTheSpread) {
  for (const double between : {0.0, 0.003, 0.02}) {
    double normalised = 0;
    int count = 0;
    for (std::uint64_t trial = 0; trial < 300; ++trial) {
      std::vector<double> truth;
      const auto made = readings(40, between, 0.006, &truth, base::derive_key(kSeed + 1, trial));
      const auto scale = pool_readings(made);
      ASSERT_TRUE(scale);
      for (std::size_t p = 0; p < truth.size(); ++p, ++count) {
        normalised +=
            std::pow(std::log(scale->intensity[p][0] / 100 / truth[p]) / scale->relative_sigma[p][0], 2);
      }
    }
    normalised /= count;
    std::cout << "between " << between << ": mean normalised square " << normalised << '\n';
    // A light that is perfectly stable cannot be known to be so: then the stated error is too large.
    EXPECT_GT(normalised, between == 0 ? 0.15 : 0.7);
    EXPECT_LT(normalised, 1.5);
  }
}

TEST(PoolReadings, ListsAPatchAndAPoseThatDisagree) {
  std::vector<double> truth;
  auto made = readings(30, 0, 0.002, &truth, kSeed);
  for (double& v : made[7][2].intensity) v *= 0.8;
  for (auto& reading : made[11]) {
    for (double& v : reading.intensity) v *= 1.3;
  }
  made[20].clear();
  const auto scale = pool_readings(made);
  ASSERT_TRUE(scale);
  ASSERT_EQ(scale->disagreements.size(), 2U);
  EXPECT_EQ(scale->disagreements[0].pose, 7U);
  EXPECT_EQ(scale->disagreements[0].patch, 2);
  EXPECT_NEAR(scale->disagreements[0].relative, -0.2, 0.01);
  EXPECT_EQ(scale->disagreements[1].pose, 11U);
  EXPECT_EQ(scale->disagreements[1].patch, -1);
  EXPECT_NEAR(scale->intensity[7][0] / 100, 1, 0.01);
  EXPECT_NEAR(scale->intensity[11][0] / 100, 1.3, 0.01);
  EXPECT_NEAR(scale->intensity[20][0], scale->mean[0], 1e-9);
}

TEST(PoolReadings, OnePoseOrNone) {
  std::vector<double> truth;
  const auto one = pool_readings(readings(1, 0, 0.002, &truth, kSeed));
  ASSERT_TRUE(one);
  EXPECT_NEAR(one->intensity[0][0], 100, 1);
  EXPECT_FALSE(pool_readings({{}, {}}));
}

}  // namespace
}  // namespace rig::calibration
