#include "sim/machine.h"

#include <chrono>
#include <gtest/gtest.h>
#include <limits>
#include <sstream>

#include "core/base/random.h"
#include "core/base/units.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"
#include "tests/sim/virtual_world.h"

namespace rig::sim {
namespace {

using base::radians;

constexpr std::size_t kPan = 2;

class MachineTest : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  testing::SetClock clock_;
  World world_ = testing::shipped_world();
  std::shared_ptr<Machine> machine_ = opened();

  std::shared_ptr<Machine> opened() {
    auto machine = Machine::open(world_, clock_, folder_.path(), testing::no_complaint);
    EXPECT_TRUE(machine.has_value());
    return *machine;
  }
  void reopen() {
    machine_.reset();
    machine_ = opened();
  }
  void home_all() {
    for (std::size_t i = 0; i < kAxes; ++i) {
      ASSERT_TRUE(machine_->enable(i, true).has_value());
      ASSERT_TRUE(machine_->home(i).has_value());
    }
    clock_.pass(60);
    for (std::size_t i = 0; i < kAxes; ++i) ASSERT_TRUE(machine_->axis_state(i).homed);
  }
  void send(std::size_t axis, double target_rad, double v = 1, double a = 2) {
    const auto sent = machine_->move(axis, target_rad, v, a);
    ASSERT_TRUE(sent.has_value()) << sent.error().text();
  }
  [[nodiscard]] double position(std::size_t axis) { return machine_->axis_state(axis).position_rad; }
};

TEST_F(MachineTest, HomesFromWhereItWasFound) {
  EXPECT_FALSE(machine_->axis_state(kPan).homed);
  EXPECT_FALSE(machine_->home(kPan).has_value());  // without power
  ASSERT_TRUE(machine_->enable(kPan, true).has_value());
  ASSERT_TRUE(machine_->home(kPan).has_value());
  EXPECT_TRUE(machine_->axis_state(kPan).moving);
  EXPECT_FALSE(machine_->move(kPan, 0.1, 1, 1).has_value());
  clock_.pass(20);
  EXPECT_TRUE(machine_->axis_state(kPan).homed);
  EXPECT_NEAR(position(kPan), world_.axes[kPan].home_rad, world_.axes[kPan].resolution_rad);
}

// A trapezoid takes distance / v + v / a; a triangle 2 sqrt(distance / a).
TEST_F(MachineTest, MovesTakeTheTimeOfTheirProfile) {
  home_all();
  base::Random random(test::seed(41));
  for (int i = 0; i < 100; ++i) {
    const double from = position(kPan);
    const double v = random.uniform(0.1, 1.0);
    const double a = random.uniform(0.2, 2.0);
    send(kPan, random.uniform(radians(-90), radians(90)), v, a);
    const auto counts = [&](double angle) {
      return static_cast<double>(counts_of(world_.axes[kPan], angle));
    };
    clock_.pass(1000);
    const double to = position(kPan);
    send(kPan, from, v, a);
    const double distance = std::abs(counts(to) - counts(from)) * world_.axes[kPan].resolution_rad;
    const double takes = distance > v * v / a ? distance / v + v / a : 2 * std::sqrt(distance / a);
    if (distance == 0) continue;
    clock_.pass(0.5 * takes);
    EXPECT_NEAR(position(kPan), 0.5 * (from + to), world_.axes[kPan].resolution_rad);
    clock_.pass(0.5 * takes - 1e-6);
    EXPECT_TRUE(machine_->axis_state(kPan).moving);
    clock_.pass(2e-6);
    EXPECT_FALSE(machine_->axis_state(kPan).moving);
    EXPECT_NEAR(position(kPan), from, 1e-12);
  }
}

TEST_F(MachineTest, NothingGoesFasterOrFurtherThanItCan) {
  home_all();
  send(kPan, radians(1000), 1e6, 1e6);
  double before = position(kPan);
  for (int i = 0; i < 400; ++i) {
    clock_.pass(0.01);
    const double here = position(kPan);
    EXPECT_LE(std::abs(here - before),
              0.01 * world_.axes[kPan].max_velocity_rad_s + world_.axes[kPan].resolution_rad);
    before = here;
  }
  EXPECT_NEAR(before, world_.axes[kPan].high_rad, world_.axes[kPan].resolution_rad);
  EXPECT_TRUE(machine_->axis_state(kPan).at_high_limit);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(machine_->move(kPan, bad, 1, 1).has_value());
  }
  EXPECT_FALSE(machine_->move(kPan, 0, 0, 1).has_value());
}

TEST_F(MachineTest, AStopBrakesAtOnce) {
  home_all();
  send(kPan, radians(80), 1, 2);
  clock_.pass(0.8);
  const double here = position(kPan);
  ASSERT_TRUE(machine_->stop(kPan).has_value());
  clock_.pass(0.5 + 1e-6);  // v / a
  EXPECT_FALSE(machine_->axis_state(kPan).moving);
  EXPECT_NEAR(position(kPan), here + 0.25, 2 * world_.axes[kPan].resolution_rad);  // v^2 / 2a
  const double rest = position(kPan);
  clock_.pass(100);
  EXPECT_EQ(position(kPan), rest);
}

TEST_F(MachineTest, TheErrorOfATargetIsBoundedAndAlwaysTheSame) {
  double lowest = 1;
  double highest = -1;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const AxisWorld& a = world_.axes[axis];
    for (std::int64_t counts = -2000; counts < 2000; ++counts) {
      const double error =
          true_angle(world_, axis, counts, false) - static_cast<double>(counts) * a.resolution_rad;
      EXPECT_LE(std::abs(error), 0.5 * a.repeatability_rad);
      EXPECT_EQ(true_angle(world_, axis, counts, false), true_angle(world_, axis, counts, false));
      EXPECT_NEAR(true_angle(world_, axis, counts, true) - true_angle(world_, axis, counts, false),
                  a.backlash_rad, 1e-12);
      lowest = std::min(lowest, error / a.repeatability_rad);
      highest = std::max(highest, error / a.repeatability_rad);
    }
  }
  EXPECT_LT(lowest, -0.49);  // the whole width is used
  EXPECT_GT(highest, 0.49);
  World other = world_;
  other.seed += 1;
  EXPECT_NE(true_angle(other, 0, 5, false), true_angle(world_, 0, 5, false));
}

// What the world remembers goes with the clock: nothing of it lies in the future of the next process.
TEST(MachineClock, SetBackIsFoundByTheNextProcessAlone) {
  const test::TemporaryFolder folder;
  World world = testing::shipped_world();
  Fault fault;
  fault.kind = FaultKind::clock_step;
  fault.amount = -3600;
  fault.times = 1;
  world.faults.faults = {fault};
  const auto open = [&](testing::SetClock& clock) {
    return *Machine::open(world, clock, folder.path(), testing::no_complaint);
  };
  testing::SetClock clock;
  const base::Time start = clock.now();
  {
    auto machine = open(clock);
    clock.pass(10);
    ASSERT_TRUE(machine->set_level(1).has_value());
    clock.pass(7200);
    EXPECT_FALSE(machine->emergency_stop());
    EXPECT_EQ(clock.now(), start + base::seconds(7210)) << "time goes on";
    EXPECT_NEAR(machine->light_state().hours, 2, 1e-9);
    clock.pass(3600);
    EXPECT_FALSE(machine->emergency_stop());
    EXPECT_NEAR(machine->light_state().hours, 3, 1e-9);
    ASSERT_TRUE(machine->set_level(1).has_value());
  }
  world.faults.faults.clear();
  testing::SetClock next;
  auto machine = open(next);
  EXPECT_EQ(next.now(), start + base::seconds(7210));
  EXPECT_NEAR(machine->light_state().hours, 3, 1e-9);
}

TEST_F(MachineTest, SameTargetSamePlaceWhateverWasBefore) {
  home_all();
  base::Random random(test::seed(42));
  const double target = radians(23);
  std::int64_t expected = counts_of(world_.axes[kPan], target);
  for (int i = 0; i < 50; ++i) {
    const double detour = random.uniform(radians(-90), radians(90));
    send(kPan, detour, random.uniform(0.1, 1));
    clock_.pass(random.uniform(0.1, 20));  // it may still be under way
    send(kPan, target);
    clock_.pass(100);
    const Scene scene = machine_->scene();
    EXPECT_EQ(scene.counts[kPan], expected);
  }
  // Only the direction of the last leg counts.
  send(kPan, target + 0.2);
  clock_.pass(100);
  send(kPan, target);
  clock_.pass(100);
  EXPECT_TRUE(machine_->scene().from_above[kPan]);
  send(kPan, target - 0.2);
  clock_.pass(100);
  send(kPan, target);
  clock_.pass(100);
  EXPECT_FALSE(machine_->scene().from_above[kPan]);
}

TEST_F(MachineTest, AMoveGoesOnAfterItsProcessDied) {
  home_all();
  send(kPan, radians(60), 0.5, 1);
  clock_.pass(1);
  const double half_way = position(kPan);
  reopen();
  EXPECT_EQ(position(kPan), half_way);
  EXPECT_TRUE(machine_->axis_state(kPan).moving);
  EXPECT_TRUE(machine_->axis_state(kPan).homed);
  clock_.pass(100);
  EXPECT_EQ(machine_->scene().counts[kPan], counts_of(world_.axes[kPan], radians(60)));
}

TEST_F(MachineTest, TimeDoesNotGoBackAfterARestart) {
  home_all();
  (void)machine_->scene();
  machine_.reset();
  testing::SetClock early;
  auto machine = Machine::open(world_, early, folder_.path(), testing::no_complaint);
  ASSERT_TRUE(machine.has_value());
  EXPECT_EQ(early.now(), clock_.now());
}

TEST_F(MachineTest, TheButtonCutsThePower) {
  home_all();
  send(kPan, radians(80));
  clock_.pass(0.7);
  test::put_bytes(folder_ / "emergency_stop", "");
  EXPECT_TRUE(machine_->emergency_stop());
  const double rest = position(kPan);
  clock_.pass(10);
  EXPECT_EQ(position(kPan), rest);
  EXPECT_FALSE(machine_->axis_state(kPan).moving);
  EXPECT_FALSE(machine_->axis_state(kPan).enabled);
  EXPECT_TRUE(machine_->axis_state(kPan).homed);
  EXPECT_FALSE(machine_->enable(kPan, true).has_value());
  EXPECT_FALSE(machine_->move(kPan, 0, 1, 1).has_value());
  std::filesystem::remove(folder_ / "emergency_stop");
  EXPECT_FALSE(machine_->emergency_stop());
  EXPECT_TRUE(machine_->enable(kPan, true).has_value());
}

TEST_F(MachineTest, APressBetweenTwoLooksIsNotMissed) {
  home_all();
  EXPECT_FALSE(machine_->emergency_stop());
  test::put_bytes(folder_ / "emergency_stop", "");
  std::filesystem::remove(folder_ / "emergency_stop");
  EXPECT_FALSE(machine_->axis_state(kPan).enabled);
  EXPECT_TRUE(machine_->emergency_stop());
  EXPECT_FALSE(machine_->emergency_stop());
  EXPECT_TRUE(machine_->enable(kPan, true).has_value());
  // A file of another name presses nothing.
  test::put_bytes(folder_ / "emergency_stop.part", "");
  EXPECT_FALSE(machine_->emergency_stop());
  EXPECT_TRUE(machine_->axis_state(kPan).enabled);
}

TEST_F(MachineTest, SwitchesAtTheLinesSeeWhereTheAxisTrulyStands) {
  world_.axes[kPan].low_switch_rad = radians(-50);
  world_.faults.faults.push_back({});
  world_.faults.faults.back().kind = FaultKind::lost_steps;
  world_.faults.faults.back().amount = radians(-10);
  world_.faults.faults.back().after = 2;
  world_.faults.faults.back().times = 1;
  reopen();
  home_all();
  const auto pan_low = [&] { return machine_->limit_lines()[kPan][0]; };
  EXPECT_FALSE(pan_low());
  send(kPan, radians(-45));
  clock_.pass(100);
  EXPECT_FALSE(pan_low());
  send(kPan, radians(-55));
  clock_.pass(100);
  EXPECT_TRUE(pan_low());
  EXPECT_TRUE(pan_low()) << "while it stands there";
  EXPECT_FALSE(machine_->axis_state(kPan).at_low_limit) << "the drive has switches of its own";
  send(kPan, radians(-45));  // loses steps
  clock_.pass(100);
  EXPECT_TRUE(pan_low());
  EXPECT_TRUE(pan_low()) << "not only for what was before";
  EXPECT_NEAR(position(kPan), radians(-45), world_.axes[kPan].resolution_rad);
  EXPECT_FALSE(machine_->limit_lines()[kPan][1]);
  EXPECT_FALSE(machine_->limit_lines()[0][0]);
}

TEST_F(MachineTest, ASwitchThatWasPressedBetweenTwoReadingsCounts) {
  home_all();
  EXPECT_FALSE(machine_->limit_lines()[kPan][1]);
  send(kPan, radians(1000));
  clock_.pass(100);
  send(kPan, 0);
  clock_.pass(100);
  EXPECT_TRUE(machine_->limit_lines()[kPan][1]) << "at the hard stop, where no other place is said";
  EXPECT_FALSE(machine_->limit_lines()[kPan][1]);
}

TEST_F(MachineTest, WhatIsUnpluggedSaysThatItIsLost) {
  world_.faults.faults.push_back({});
  world_.faults.faults.back().kind = FaultKind::unplugged;
  world_.faults.faults.back().device = "pan";
  world_.faults.faults.back().times = 1;
  reopen();
  EXPECT_TRUE(machine_->reach("arm").has_value());
  const auto pan = machine_->reach("pan");
  ASSERT_FALSE(pan.has_value());
  EXPECT_EQ(pan.error().code, base::ErrorCode::lost);
  EXPECT_TRUE(machine_->reach("pan").has_value());
}

TEST_F(MachineTest, NotesWhenAStopReachesADrive) {
  world_.wire_log = "wire.log";
  reopen();
  const auto steady_ns = [] { return std::chrono::steady_clock::now().time_since_epoch().count(); };
  home_all();
  EXPECT_EQ(test::bytes_in(folder_ / "wire.log"), "");
  const auto before_ns = steady_ns();
  ASSERT_TRUE(machine_->stop(kPan).has_value());
  const auto after_ns = steady_ns();
  reopen();  // what an earlier one noted stays
  ASSERT_TRUE(machine_->stop(0).has_value());
  std::istringstream lines(test::bytes_in(folder_ / "wire.log"));
  std::chrono::steady_clock::rep ns = 0;
  std::string what;
  std::string axis;
  ASSERT_TRUE(lines >> ns >> what >> axis);
  EXPECT_LE(before_ns, ns);
  EXPECT_LE(ns, after_ns);
  EXPECT_EQ(what + " " + axis, "stop pan");
  ASSERT_TRUE(lines >> ns >> what >> axis);
  EXPECT_LE(after_ns, ns);
  EXPECT_EQ(axis, "roll");
  EXPECT_FALSE(lines >> ns);
}

TEST_F(MachineTest, AWireLogNeedsItsFolder) {
  world_.wire_log = "nowhere/wire.log";
  machine_.reset();
  EXPECT_FALSE(Machine::open(world_, clock_, folder_.path(), testing::no_complaint).has_value());
}

TEST_F(MachineTest, TheLampWarmsUpAndCountsItsHours) {
  ASSERT_TRUE(machine_->set_level(1).has_value());
  EXPECT_EQ(machine_->scene().light, 0);  // behind the shutter
  machine_->set_shutter(true);
  EXPECT_NEAR(machine_->scene().light, world_.light.cold_share, 1e-12);
  double before = 0;
  for (int i = 0; i < 9; ++i) {
    EXPECT_FALSE(machine_->light_state().warm);
    EXPECT_GT(machine_->scene().light, before);
    before = machine_->scene().light;
    clock_.pass(world_.light.warm_up_s / 9 + 1e-6);
  }
  EXPECT_TRUE(machine_->light_state().warm);
  EXPECT_EQ(machine_->scene().light, 1);
  reopen();
  EXPECT_EQ(machine_->scene().light, 1);
  ASSERT_TRUE(machine_->set_level(0).has_value());
  clock_.pass(5000);
  EXPECT_NEAR(machine_->light_state().hours, world_.light.warm_up_s / 3600, 1e-6);
  EXPECT_FALSE(machine_->set_level(1.1).has_value());
  EXPECT_FALSE(machine_->set_level(std::numeric_limits<double>::quiet_NaN()).has_value());
}

}  // namespace
}  // namespace rig::sim
