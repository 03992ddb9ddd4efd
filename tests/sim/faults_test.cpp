#include "sim/faults.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "sim/hash_painter.h"
#include "sim/machine.h"
#include "tests/core/temporary_folder.h"
#include "tests/sim/virtual_world.h"

namespace rig::sim {
namespace {

using ::testing::HasSubstr;

FaultPlan plan_of(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "faults.toml");
  EXPECT_TRUE(table.has_value());
  FaultPlan plan = read_fault_plan(*table);
  const auto fine = table->finish();
  EXPECT_TRUE(fine.has_value()) << fine.error().text();
  return plan;
}

std::string mistake_in(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "faults.toml");
  EXPECT_TRUE(table.has_value());
  (void)read_fault_plan(*table);
  const auto fine = table->finish();
  return fine ? "none" : fine.error().text();
}

TEST(FaultPlan, ReadsEveryKindWithItsUnit) {
  const FaultPlan plan = plan_of(
      "seed = 4\n[[fault]]\nkind = \"lost-steps\"\ndevice = \"pan\"\nby_deg = 2\nfrom_s = 5\nfor_s = 7\n"
      "[[fault]]\nkind = \"slow\"\nby_s = 3\nchance = 0.25\nafter = 2\ntimes = 9\n"
      "[[fault]]\nkind = \"limit-switch\"\nside = \"low\"\n[[fault]]\nkind = \"stall\"\n");
  ASSERT_EQ(plan.faults.size(), 4U);
  EXPECT_EQ(plan.seed, 4U);
  EXPECT_EQ(plan.faults[0].kind, FaultKind::lost_steps);
  EXPECT_NEAR(plan.faults[0].amount, base::radians(2), 1e-12);
  EXPECT_EQ(plan.faults[0].until_s, 12);
  EXPECT_EQ(plan.faults[1].amount, 3);
  EXPECT_EQ(plan.faults[1].chance, 0.25);
  EXPECT_EQ(plan.faults[1].after, 2U);
  EXPECT_EQ(plan.faults[1].times, 9U);
  EXPECT_FALSE(plan.faults[2].high_side);
  EXPECT_EQ(plan.faults[3].amount, 0.5);
}

TEST(FaultPlan, SaysWhatIsWrongAndWhere) {
  const auto expect = [](const std::string& text, const std::string& line, const std::string& what) {
    EXPECT_THAT(mistake_in(text), HasSubstr(line)) << text;
    EXPECT_THAT(mistake_in(text), HasSubstr(what)) << text;
  };
  expect("[[fault]]\nkind = \"stal\"\n", "faults.toml:2:", "stall");
  expect("[[fault]]\nby_s = 1\n", "faults.toml:1:", "kind");
  expect("[[fault]]\nkind = \"slow\"\n", "faults.toml:1:", "by_s");
  expect("[[fault]]\nkind = \"slow\"\nby_s = -1\n", "faults.toml:3:", "by_s");
  expect("[[fault]]\nkind = \"stall\"\ndevice = \"camera\"\n", "faults.toml:3:", "arm");
  expect("[[fault]]\nkind = \"limit-switch\"\n", "faults.toml:1:", "side");
  expect("[[fault]]\nkind = \"stall\"\nchance = 1.5\n", "faults.toml:3:", "chance");
  expect("[[fault]]\nkind = \"stall\"\nby_deg = 1\n", "faults.toml:3:", "by_deg");
  expect("[[fault]]\nkind = \"garbage\"\ntimes = -1\n", "faults.toml:3:", "times");
}

TEST(FaultPlan, IsPartOfTheSettings) {
  const auto table =
      base::ConfigTable::parse("[faults]\n[[faults.fault]]\nkind = \"nonsense\"\n", "rig.toml");
  ASSERT_TRUE(table.has_value());
  (void)read_world(*table);
  EXPECT_THAT(table->finish().error().text(), HasSubstr("rig.toml:3:"));
}

class FaultsTest : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::vector<std::string> complaints_;
};

TEST_F(FaultsTest, StrikeWithinTheirTimeAfterSoManyOccasionsAndSoOften) {
  Faults f(
      plan_of("[[fault]]\nkind = \"slow\"\ndevice = \"camera\"\nby_s = 2\nfrom_s = 10\nfor_s = 5\nafter = "
              "1\ntimes = 2\n"),
      folder_ / "faults.toml", [](const std::string&) {});
  EXPECT_FALSE(f.strike(FaultKind::slow, "camera", 9.9));
  EXPECT_FALSE(f.strike(FaultKind::slow, "light", 10));
  EXPECT_FALSE(f.strike(FaultKind::garbage, "camera", 10));
  EXPECT_FALSE(f.strike(FaultKind::slow, "camera", 10));  // the first occasion passes
  EXPECT_EQ(f.strike(FaultKind::slow, "camera", 11), 2);
  EXPECT_EQ(f.strike(FaultKind::slow, "camera", 12), 2);
  EXPECT_FALSE(f.strike(FaultKind::slow, "camera", 13));
}

TEST_F(FaultsTest, OfAChanceStrikeThatOftenAndTheSameWithTheSameSeed) {
  const std::string text = "[[fault]]\nkind = \"garbage\"\nchance = 0.2\n";
  const auto pattern = [&](int seed) {
    Faults f(plan_of(fmt::format("seed = {}\n{}", seed, text)), folder_ / "none", [](const std::string&) {});
    std::string struck;
    for (int i = 0; i < 2000; ++i) struck += f.strike(FaultKind::garbage, "arm", i) ? 'x' : '-';
    return struck;
  };
  const std::string once = pattern(1);
  EXPECT_EQ(once, pattern(1));
  EXPECT_NE(once, pattern(2));
  EXPECT_NEAR(static_cast<double>(std::count(once.begin(), once.end(), 'x')), 400, 60);
}

TEST_F(FaultsTest, FollowTheirFile) {
  Faults f(plan_of(""), folder_ / "faults.toml",
           [this](const std::string& text) { complaints_.push_back(text); });
  const auto struck = [&] { return f.strike_switch(FaultKind::limit_switch, "pan", true, 0); };
  EXPECT_FALSE(struck());
  test::put_bytes(folder_ / "faults.toml", "[[fault]]\nkind = \"limit-switch\"\nside = \"high\"\n");
  EXPECT_TRUE(struck());
  EXPECT_FALSE(f.strike_switch(FaultKind::limit_switch, "pan", false, 0));
  test::put_bytes(folder_ / "faults.toml", "[[fault]]\nkind = \"nonsense\"\n");
  EXPECT_TRUE(struck());  // as before
  EXPECT_TRUE(struck());
  ASSERT_EQ(complaints_.size(), 1U);
  EXPECT_THAT(complaints_[0], HasSubstr("faults.toml:2:"));
  std::filesystem::remove(folder_ / "faults.toml");
  EXPECT_FALSE(struck());
}

TEST_F(FaultsTest, LostStepsLastUntilHomingAlsoBeyondTheDeathOfTheProcess) {
  constexpr std::size_t kPan = 2;
  testing::SetClock clock;
  World world = testing::shipped_world();
  world.faults = plan_of("[[fault]]\nkind = \"lost-steps\"\ndevice = \"pan\"\nby_deg = 1\ntimes = 1\n");
  const auto opened = [&] { return *Machine::open(world, clock, folder_.path(), testing::no_complaint); };
  auto machine = opened();
  ASSERT_TRUE(machine->enable(kPan, true).has_value());
  ASSERT_TRUE(machine->move(kPan, 0.2, 1, 1).has_value());
  clock.pass(10);
  EXPECT_NEAR(machine->axis_state(kPan).position_rad, 0.2, world.axes[kPan].resolution_rad);
  EXPECT_NEAR(machine->scene().astray[kPan], base::radians(1), 1e-12);
  world.faults = {};
  machine.reset();
  machine = opened();
  EXPECT_NEAR(machine->scene().astray[kPan], base::radians(1), 1e-12);
  ASSERT_TRUE(machine->home(kPan).has_value());
  clock.pass(60);
  ASSERT_TRUE(machine->axis_state(kPan).homed);
  EXPECT_EQ(machine->scene().astray[kPan], 0);
}

TEST_F(FaultsTest, AStalledAxisStandsAndSaysThatItMovesUntilItIsStopped) {
  constexpr std::size_t kPan = 2;
  testing::SetClock clock;
  World world = testing::shipped_world();
  world.faults = plan_of("[[fault]]\nkind = \"stall\"\ndevice = \"pan\"\nshare = 0.25\ntimes = 1\n");
  auto machine = *Machine::open(world, clock, folder_.path(), testing::no_complaint);
  ASSERT_TRUE(machine->enable(kPan, true).has_value());
  const double from = machine->axis_state(kPan).position_rad;
  ASSERT_TRUE(machine->move(kPan, from + 0.4, 1, 1).has_value());
  clock.pass(100);
  EXPECT_NEAR(machine->axis_state(kPan).position_rad, from + 0.1, world.axes[kPan].resolution_rad);
  EXPECT_TRUE(machine->axis_state(kPan).moving);
  ASSERT_TRUE(machine->stop(kPan).has_value());
  EXPECT_FALSE(machine->axis_state(kPan).moving);
  ASSERT_TRUE(machine->move(kPan, from + 0.4, 1, 1).has_value());
  clock.pass(100);
  EXPECT_NEAR(machine->axis_state(kPan).position_rad, from + 0.4, world.axes[kPan].resolution_rad);
}

TEST(HashPainter, IsAFunctionOfKeyAndLightWithinTheSensorsRange) {
  const CameraWorld camera = testing::shipped_world().camera;
  const auto painted = [&](double effective_s, std::uint64_t key) {
    std::vector<std::uint16_t> pixels(1001);
    paint_hashed(camera, effective_s, 1, key, pixels);
    for (const std::uint16_t v : pixels) {
      EXPECT_GE(v, camera.black_dn);
      EXPECT_LE(v, camera.saturation_dn);
    }
    return pixels;
  };
  const auto bright = painted(camera.white_fills_s, 1);
  EXPECT_EQ(bright, painted(camera.white_fills_s, 1));
  EXPECT_NE(bright, painted(camera.white_fills_s, 2));
  EXPECT_NE(bright, painted(0.5 * camera.white_fills_s, 1));
  EXPECT_GT(*std::max_element(bright.begin(), bright.end()), 0.9 * camera.saturation_dn);
  const auto dark = painted(0, 1);
  EXPECT_LT(*std::max_element(dark.begin(), dark.end()), camera.black_dn + 4);
}

}  // namespace
}  // namespace rig::sim
