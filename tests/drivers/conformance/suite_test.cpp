// The suite itself: a right module passes every check, and every check finds a module that is wrong.
#include "drivers/conformance/suite.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <iostream>
#include <optional>
#include <set>

#include "drivers/api/module.h"
#include "tests/drivers/conformance/fake_bench.h"

namespace rig::drivers::conformance {
namespace {

const Check& check_named(const std::string& name) {
  const auto found =
      std::find_if(checks().begin(), checks().end(), [&](const Check& c) { return c.name == name; });
  if (found == checks().end()) throw std::invalid_argument("there is no check '" + name + "'");
  return *found;
}

Outcome outcome_of(Flaw flaw, const std::string& check) {
  const auto bench = make_fake_bench(flaw);
  return run_check(*bench, check_named(check));
}

TEST(Suite, ARightModulePassesEveryCheck) {
  for (const Check& check : checks()) {
    const auto bench = make_fake_bench(Flaw::none);
    const Outcome outcome = run_check(*bench, check);
    EXPECT_EQ(outcome.verdict, Verdict::passed) << check.name << ": " << outcome.text;
  }
}

TEST(Suite, ChecksHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const Check& check : checks()) EXPECT_TRUE(names.insert(check.name).second) << check.name;
}

struct Wrong {
  Flaw flaw;
  const char* found_by;
  std::optional<bool> for_good =
      std::nullopt;  // whether a further try must not take it back; nothing: either
};

// Every flaw with each of the checks that have to find it.
const std::vector<Wrong>& wrong_modules() {
  static const std::vector<Wrong> all{
      {Flaw::twin_names, "module: devices are named"},
      {Flaw::leaks_descriptor, "module: a thousand openings leak nothing"},
      {Flaw::leaks_thread, "module: a thousand openings leak nothing"},
      {Flaw::throws_at_opening, "module: a thousand openings leak nothing"},
      {Flaw::throws_at_opening, "module: devices are named"},
      {Flaw::finer_than_true, "axis: capabilities are true"},
      {Flaw::too_fast, "axis: capabilities are true"},
      {Flaw::arrived_too_early, "axis: a move arrives and proves it", true},
      {Flaw::arrives_elsewhere, "axis: a move arrives and proves it"},
      {Flaw::swallows_new_target, "axis: a new target while moving"},
      {Flaw::move_lost_in_homing, "axis: a command while homing"},
      {Flaw::silent_without_power, "axis: no move without power"},
      {Flaw::takes_nonsense, "axis: moves that make no sense"},
      {Flaw::moves_at_opening, "axis: closed in a move and opened again"},
      {Flaw::moves_at_opening, "axis: killed in a move and opened again"},
      {Flaw::homed_by_its_file, "axis: a power cycle while away", true},
      {Flaw::loses_stop, "axis: abort during a move", true},
      {Flaw::stops_late, "axis: abort during a move", false},
      {Flaw::stop_forgets_home, "axis: a stop at rest is harmless"},
      {Flaw::no_stop_after_bad_answer, "axis: a stop on a bad wire", true},
      {Flaw::loses_stop, "axis: a stop on a bad wire"},
      {Flaw::homed_too_early, "axis: homing", true},
      {Flaw::moves_unhomed, "axis: refusal before homing"},
      {Flaw::believes_homed, "axis: refusal before homing"},
      {Flaw::homed_after_abort, "axis: abort of homing", true},
      {Flaw::loses_stop, "axis: abort of homing"},
      {Flaw::jogs_fast, "axis: a jog before homing"},
      {Flaw::jogs_to_an_angle, "axis: a jog before homing"},
      {Flaw::homed_by_a_jog, "axis: a jog before homing"},
      {Flaw::jogs_nonsense, "axis: a jog before homing"},
      {Flaw::loses_stop, "axis: a jog before homing"},
      {Flaw::swapped_limits, "axis: limits from both sides"},
      {Flaw::goes_into_limit, "axis: limits from both sides"},
      {Flaw::hides_fault, "axis: a fault of the drive"},
      {Flaw::fault_acknowledged_away, "axis: a fault of the drive"},
      {Flaw::makes_up_state, "axis: missing answers"},
      {Flaw::no_calls_deadline, "axis: most answers missing"},
      {Flaw::loses_stop, "axis: most answers missing"},
      {Flaw::believes_garbage, "axis: garbled answers"},
      {Flaw::reads_old_answers, "axis: late answers"},
      {Flaw::reads_old_answers, "axis: doubled answers"},
      {Flaw::never_back, "axis: lost at rest and back"},
      {Flaw::hangs_when_lost, "axis: lost at rest and back"},
      {Flaw::lost_is_device, "axis: lost at rest and back"},
      {Flaw::makes_up_state, "axis: lost at rest and back"},
      {Flaw::resends_target, "axis: lost in a move and back"},
      {Flaw::homed_on_return, "axis: lost while homing and back"},
      {Flaw::believes_homed, "axis: lost with its reference and back"},
      {Flaw::keeps_the_line, "axis: absent at opening"},
      {Flaw::leaves_last_line, "camera: capabilities are true"},
      {Flaw::exposes_twice_as_long, "camera: exposure as asked and as reported"},
      {Flaw::reports_wrong_exposure, "camera: exposure as asked and as reported"},
      {Flaw::frame_of_before, "camera: a bracket of eight"},
      {Flaw::counter_stands, "camera: a bracket of eight"},
      {Flaw::counter_stands, "camera: frames are counted"},
      {Flaw::frame_of_before, "camera: none from before the setting took effect", true},
      {Flaw::takes_second_trigger, "camera: a trigger while exposing"},
      {Flaw::abort_does_nothing, "camera: abort of an exposure", true},
      {Flaw::overruns_buffer, "camera: the buffer is never overrun", true},
      {Flaw::takes_small_buffer, "camera: the buffer is never overrun"},
      {Flaw::delivers_corrupt, "camera: corrupt frames are detected", true},
      {Flaw::corrupt_is_device, "camera: corrupt frames are detected"},
      {Flaw::fills_in_missing, "camera: missing frames are detected", true},
      {Flaw::never_back, "camera: lost in the middle of a bracket and back"},
      {Flaw::delivers_unplugged, "camera: lost while exposing and back", true},
      {Flaw::keeps_the_line, "camera: absent at opening"},
      {Flaw::frame_over_death, "camera: closed while exposing and opened again"},
      {Flaw::frame_over_death, "camera: killed while exposing and opened again", true},
      {Flaw::ends_only_in_order, "camera: killed while exposing and opened again"},
      {Flaw::level_off, "light: the level shines and is read back"},
      {Flaw::no_shutter, "light: the shutter"},
      {Flaw::level_believed, "light: closed while it shines and opened again"},
      {Flaw::off_by_belief, "light: closed while it shines and opened again"},
      {Flaw::off_by_belief, "light: killed while it shines and opened again"},
      {Flaw::believes_garbage, "light: spoilt answers"},
      {Flaw::reads_old_answers, "light: spoilt answers"},
      {Flaw::no_calls_deadline, "light: most answers missing"},
      {Flaw::makes_up_state, "light: most answers missing"},
      {Flaw::makes_up_state, "light: lost and back"},
      {Flaw::never_back, "light: lost and back"},
      {Flaw::keeps_the_line, "light: absent at opening"},
      {Flaw::slow_input, "lines: an input is seen within its bound", false},
      {Flaw::misses_press, "lines: a short press is not missed"},
      {Flaw::output_read_believed, "lines: outputs are set and read back"},
      {Flaw::leaves_output, "lines: a defined state on start and on exit"},
      {Flaw::sets_anything, "lines: unknown lines and inputs are not set"},
      {Flaw::invents_levels, "lines: lost and back"},
      {Flaw::never_back, "lines: lost and back"},
      {Flaw::keeps_the_line, "lines: absent at opening"},
      {Flaw::input_by_edges, "lines: closed and opened again"},
      {Flaw::input_by_edges, "lines: killed with its output set and opened again"},
      {Flaw::rests_only_in_order, "lines: killed with its output set and opened again"},
      {Flaw::invents_levels, "lines: spoilt answers"},
      {Flaw::believes_garbage, "lines: spoilt answers"},
  };
  return all;
}

// What a kill alone shows: closed in order, these are right.
TEST(Suite, AModuleThatReliesOnItsDestructorsPassesWhereItIsClosed) {
  EXPECT_EQ(outcome_of(Flaw::ends_only_in_order, "camera: closed while exposing and opened again").verdict,
            Verdict::passed);
  EXPECT_EQ(outcome_of(Flaw::rests_only_in_order, "lines: a defined state on start and on exit").verdict,
            Verdict::passed);
}

class SuiteFinds : public ::testing::TestWithParam<std::size_t> {};

TEST_P(SuiteFinds, WhatIsWrong) {
  const Wrong& wrong = wrong_modules()[GetParam()];
  const Outcome outcome = outcome_of(wrong.flaw, wrong.found_by);
  EXPECT_EQ(outcome.verdict, Verdict::failed) << wrong.found_by << ": " << outcome.text;
  EXPECT_FALSE(outcome.text.empty());
  EXPECT_EQ(outcome.for_good, wrong.for_good.value_or(outcome.for_good)) << outcome.text;
  std::cout << wrong.found_by << ": " << outcome.text << "\n";
}

INSTANTIATE_TEST_SUITE_P(Each, SuiteFinds, ::testing::Range<std::size_t>(0, wrong_modules().size()));

TEST(Suite, EveryCheckCanFail) {
  std::set<std::string> found;
  for (const Wrong& wrong : wrong_modules()) found.insert(wrong.found_by);
  for (const Check& check : checks()) EXPECT_EQ(found.count(check.name), 1U) << check.name;
}

TEST(Suite, FindsALeakOfMemory) {
  if (std::string(RIG_DRIVER_SANITIZER) != "none")
    GTEST_SKIP() << "the sanitizer's own allocator counts nothing";
  const Outcome outcome = outcome_of(Flaw::leaks_memory, "module: a thousand openings leak nothing");
  EXPECT_EQ(outcome.verdict, Verdict::failed);
  EXPECT_NE(outcome.text.find("bytes"), std::string::npos) << outcome.text;
}

// A bench with nothing on it: nothing of any kind is claimed.
class EmptyBench final : public Bench {
 public:
  [[nodiscard]] std::string name() const override { return "empty"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override { return std::vector<Device>(); }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override {}
  [[nodiscard]] Wire& wire() override { return wire_; }

 private:
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  Wire wire_;
};

TEST(Suite, ABenchWithoutADeviceProvesNothingOfIt) {
  EmptyBench bench;
  for (const Check& check : checks()) {
    const Outcome outcome = run_check(bench, check);
    if (check.name.find("module:") == 0) continue;
    EXPECT_EQ(outcome.verdict, Verdict::none) << check.name << ": " << outcome.text;
  }
}

}  // namespace
}  // namespace rig::drivers::conformance
