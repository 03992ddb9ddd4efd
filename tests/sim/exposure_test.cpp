// From photoelectrons to digital numbers, and the camera's frames.
#include "sim/exposure.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <limits>

#include "core/base/random.h"
#include "sim/camera.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"
#include "tests/sim/virtual_world.h"

namespace rig::sim {
namespace {

struct Moments {
  double mean = 0;
  double variance = 0;
};

Moments moments(const std::vector<std::uint16_t>& values) {
  Moments m;
  for (const std::uint16_t v : values) m.mean += v;
  m.mean /= static_cast<double>(values.size());
  for (const std::uint16_t v : values) m.variance += (v - m.mean) * (v - m.mean);
  m.variance /= static_cast<double>(values.size() - 1);
  return m;
}

std::vector<std::uint16_t> exposed(const CameraWorld& camera, float electrons_per_s, double seconds,
                                   double gain, std::uint64_t key, std::size_t n) {
  const std::vector<float> rates(n, electrons_per_s);
  std::vector<std::uint16_t> out(n);
  expose(camera, rates, seconds, gain, key, out);
  return out;
}

// The noise of a linear sensor: photons, read noise and quantisation (EMVA 1288). Mean and variance of n
// samples are within five of their own standard errors.
TEST(Exposure, HasTheMeanAndTheVarianceOfTheory) {
  const CameraWorld camera = testing::shipped_world().camera;
  constexpr std::size_t kN = 200000;
  const std::uint64_t seed = test::seed(51);
  std::uint64_t key = seed;
  for (const double gain : {1.0, 2.0}) {
    for (const double electrons : {0.0, 3.0, 12.0, 24.0, 26.0, 100.0, 1000.0, 10000.0}) {
      const double per_electron = gain / camera.electrons_per_dn;
      const auto m = moments(exposed(camera, static_cast<float>(electrons * 2), 0.5, gain, ++key, kN));
      const double variance =
          (electrons + camera.read_noise_e * camera.read_noise_e) * per_electron * per_electron + 1.0 / 12;
      EXPECT_NEAR(m.mean, camera.black_dn + electrons * per_electron, 5 * std::sqrt(variance / kN) + 1e-4)
          << electrons << ' ' << gain;
      EXPECT_NEAR(m.variance, variance, 5 * variance * std::sqrt(3.0 / kN)) << electrons << ' ' << gain;
    }
  }
}

TEST(Exposure, SaturatesAndNeverGoesBelowZero) {
  CameraWorld camera = testing::shipped_world().camera;
  for (const std::uint16_t v : exposed(camera, 1e9F, 1, 1, 7, 1000)) ASSERT_EQ(v, camera.saturation_dn);
  camera.black_dn = 0;
  const auto dark = exposed(camera, 0, 1, 1, 7, 1000);
  EXPECT_EQ(*std::min_element(dark.begin(), dark.end()), 0);
  EXPECT_LT(*std::max_element(dark.begin(), dark.end()), 10);
}

TEST(Exposure, NoiseDependsOnKeyAndPlaceAlone) {
  const CameraWorld camera = testing::shipped_world().camera;
  for (const float rate : {5.0F, 500.0F}) {
    const auto whole = exposed(camera, rate, 1, 1, 99, 100001);
    EXPECT_EQ(exposed(camera, rate, 1, 1, 99, 100001), whole);
    EXPECT_NE(exposed(camera, rate, 1, 1, 98, 100001), whole);
    const auto part = exposed(camera, rate, 1, 1, 99, 777);
    EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin()));
  }
}

class CameraTest : public ::testing::Test {
 protected:
  testing::SetClock clock_;
  World world_ = testing::small_world(64, 48, 3);
  test::TemporaryFolder folder_;

  struct Rig {
    std::shared_ptr<Machine> machine;
    std::unique_ptr<VirtualCamera> camera;
  };
  Rig made(const std::string& name) {
    std::filesystem::create_directories(folder_ / name);
    auto machine = Machine::open(world_, clock_, folder_ / name, testing::no_complaint);
    EXPECT_TRUE(machine.has_value());
    Rig rig{*machine, std::make_unique<VirtualCamera>(*machine)};
    for (std::size_t i = 0; i < kAxes; ++i) {
      EXPECT_TRUE(rig.machine->enable(i, true).has_value());
      EXPECT_TRUE(rig.machine->home(i).has_value());
    }
    EXPECT_TRUE(rig.machine->set_level(1).has_value());
    rig.machine->set_shutter(true);
    clock_.pass(2000);
    return rig;
  }
  std::vector<std::uint16_t> shot(Rig& rig, double exposure_s) {
    EXPECT_TRUE(rig.camera->trigger(exposure_s, 1).has_value());
    clock_.pass(exposure_s + world_.camera.readout_s + 1e-6);
    std::vector<std::uint16_t> pixels(64 * 48);
    const auto info = rig.camera->fetch(pixels);
    EXPECT_TRUE(info.has_value() && info->has_value());
    return pixels;
  }
  void move(Rig& rig, double pan_rad) {
    EXPECT_TRUE(rig.machine->move(2, pan_rad, 1, 2).has_value());
    clock_.pass(50);
  }
};

TEST_F(CameraTest, PixelsDoNotDependOnHistory) {
  Rig a = made("a");
  Rig b = made("b");
  move(a, 0.3);
  ASSERT_TRUE(a.camera->arm().has_value());
  const auto first = shot(a, 0.01);
  const auto longer = shot(a, 0.04);
  const auto again = shot(a, 0.01);
  EXPECT_NE(first, again);  // a repeat has its own noise
  // Another rig of the same seed, after other moves, other exposures and another order.
  move(b, 0.1);
  (void)shot(b, 0.01);
  (void)shot(b, 0.02);
  move(b, 0.3);
  ASSERT_TRUE(b.camera->arm().has_value());
  EXPECT_EQ(shot(b, 0.04), longer);
  EXPECT_EQ(shot(b, 0.01), first);
  EXPECT_EQ(shot(b, 0.01), again);
  // And the same one, armed anew.
  ASSERT_TRUE(a.camera->arm().has_value());
  EXPECT_EQ(shot(a, 0.01), first);
}

TEST_F(CameraTest, AnotherSeedIsAnotherWorld) {
  Rig a = made("a");
  const auto first = shot(a, 0.01);
  world_.seed += 1;
  Rig b = made("b");
  EXPECT_NE(shot(b, 0.01), first);
}

TEST_F(CameraTest, DeliversWhenItIsReadyAndOnlyThen) {
  Rig rig = made("a");
  std::vector<std::uint16_t> pixels(64 * 48);
  EXPECT_FALSE(rig.camera->fetch(pixels).has_value());  // nothing was triggered
  ASSERT_TRUE(rig.camera->trigger(0.1, 1).has_value());
  EXPECT_FALSE(rig.camera->trigger(0.1, 1).has_value());  // busy
  clock_.pass(0.1 + 0.5 * world_.camera.readout_s);
  auto early = rig.camera->fetch(pixels);
  ASSERT_TRUE(early.has_value());
  EXPECT_FALSE(early->has_value());
  clock_.pass(0.5 * world_.camera.readout_s + 1e-6);
  std::vector<std::uint16_t> too_small(7);
  EXPECT_FALSE(rig.camera->fetch(too_small).has_value());
  auto ready = rig.camera->fetch(pixels);
  ASSERT_TRUE(ready.has_value() && ready->has_value());
  EXPECT_EQ((*ready)->exposure_s, 0.1);
  ASSERT_TRUE(rig.camera->trigger(0.1, 1).has_value());
  ASSERT_TRUE(rig.camera->abort().has_value());
  EXPECT_FALSE(rig.camera->fetch(pixels).has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, 1e-9, 100.0, nan}) {
    EXPECT_FALSE(rig.camera->trigger(bad, 1).has_value()) << bad;
  }
  EXPECT_FALSE(rig.camera->trigger(0.1, 0).has_value());
}

TEST_F(CameraTest, SeesTheBlackLevelInTheDark) {
  Rig rig = made("a");
  rig.machine->set_shutter(false);
  const auto m = moments(shot(rig, 1));
  EXPECT_NEAR(m.mean, world_.camera.black_dn, 0.2);
}

}  // namespace
}  // namespace rig::sim
