// The module, loaded as rigd loads it, against a board of lines.
#include <algorithm>
#include <cerrno>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/drivers/gpiod_lines/bench.h"

namespace rig::drivers::gpiod_lines {
namespace {

using base::ErrorCode;
using std::chrono::milliseconds;
using testing::HasSubstr;

// Order of DigitalIo::lines(): emergency_stop, limit, lamp, shutter, spare, trigger.
constexpr std::size_t kEmergency = 0, kAtLimit = 1;

class GpiodLines : public testing::Test {
 protected:
  void open(const std::string& settings) {
    devices_.clear();
    auto opened = bench_.open_with(settings);
    ASSERT_TRUE(opened) << opened.error().text();
    devices_ = std::move(*opened);
  }
  void open() { open(settings_for(bench_.board().path())); }
  void close() { devices_.clear(); }

  DigitalIo& lines() { return *std::get<std::unique_ptr<DigitalIo>>(devices_.at(0).is); }
  Light& light() { return *std::get<std::unique_ptr<Light>>(devices_.at(1).is); }
  bool reads(std::size_t line) {
    const auto levels = lines().read();
    EXPECT_TRUE(levels) << levels.error().text();
    return levels.value().at(line);
  }
  std::size_t index_of(const std::string& name) {
    const auto all = lines().lines();
    return static_cast<std::size_t>(
        std::find_if(all.begin(), all.end(), [&](const Line& l) { return l.name == name; }) - all.begin());
  }
  // Looks until the chip is back.
  void wait_until_back() {
    for (int tries = 0; tries < 500; ++tries) {
      if (lines().read()) return;
      std::this_thread::sleep_for(milliseconds(10));
    }
    FAIL() << "the chip did not come back";
  }

  LinesBench bench_;
  sim::wire::LineBoard& board_ = bench_.board();
  std::vector<Device> devices_;
};

TEST_F(GpiodLines, OffersLinesAndALightOnOneBus) {
  open();
  ASSERT_EQ(devices_.size(), 2U);
  EXPECT_EQ(devices_[0].name, "lines");
  EXPECT_EQ(devices_[1].name, "light");
  EXPECT_EQ(devices_[0].bus, devices_[1].bus);
  std::vector<std::string> names;
  for (const Line& line : lines().lines()) names.push_back((line.output ? "out " : "in ") + line.name);
  EXPECT_THAT(names, testing::UnorderedElementsAre("in emergency_stop", "in limit", "out lamp", "out shutter",
                                                   "out trigger", "out spare"));
}

TEST_F(GpiodLines, WithoutALightThereIsNone) {
  open(fmt::format("chip = 'unix:{}'\n[input.a]\noffset = 0\n", board_.path().string()));
  EXPECT_EQ(devices_.size(), 1U);
}

TEST_F(GpiodLines, OutputsAreAtTheirLevelOfStartAndOfExit) {
  EXPECT_FALSE(board_.is_output(kShutter));
  open();
  EXPECT_TRUE(board_.is_output(kShutter));
  EXPECT_TRUE(board_.high(kShutter));  // active is low
  EXPECT_FALSE(board_.high(kSpare));
  ASSERT_TRUE(lines().set("shutter", true));
  ASSERT_TRUE(lines().set("spare", true));
  EXPECT_FALSE(board_.high(kShutter));
  EXPECT_TRUE(board_.high(kSpare));
  close();
  EXPECT_TRUE(board_.high(kShutter));
  EXPECT_FALSE(board_.high(kSpare));
  EXPECT_TRUE(board_.is_output(kSpare));
}

TEST_F(GpiodLines, LevelsOfStartAndExitCanBeActiveOrKept) {
  const std::string settings = fmt::format(
      "chip = 'unix:{}'\n[output.a]\noffset = 2\nat_start = 'active'\n"
      "[output.b]\noffset = 3\nat_exit = 'active'\n[output.c]\noffset = 4\nat_start = 'keep'\nat_exit = "
      "'keep'\n",
      board_.path().string());
  open(settings);
  EXPECT_TRUE(board_.high(2));
  EXPECT_FALSE(board_.high(3));
  EXPECT_FALSE(board_.high(4));  // it was no output: nothing to keep
  ASSERT_TRUE(lines().set("c", true));
  close();
  EXPECT_FALSE(board_.high(2));
  EXPECT_TRUE(board_.high(3));
  EXPECT_TRUE(board_.high(4));
  (void)board_.changes(4);
  open(settings);
  EXPECT_TRUE(board_.high(4));
  EXPECT_TRUE(board_.changes(4).empty());
  EXPECT_TRUE(reads(index_of("c")));
}

TEST_F(GpiodLines, ABrokenWireOfTheEmergencyStopReadsActive) {
  open();
  EXPECT_FALSE(reads(kEmergency));
  board_.drive(kEmergencyStop, std::nullopt);
  EXPECT_TRUE(reads(kEmergency));
  EXPECT_TRUE(reads(kEmergency));
  board_.drive(kEmergencyStop, false);
  EXPECT_TRUE(reads(kEmergency));  // it was active after the read before
  EXPECT_FALSE(reads(kEmergency));
}

TEST_F(GpiodLines, APressBetweenTwoReadsIsSeen) {
  open();
  EXPECT_FALSE(reads(kEmergency));
  board_.drive_burst(kEmergencyStop, {true, false});
  EXPECT_TRUE(reads(kEmergency));
  EXPECT_FALSE(reads(kEmergency));
}

TEST_F(GpiodLines, MoreChangesThanTheKernelKeepsDoNotHideAPress) {
  open();
  EXPECT_FALSE(reads(kEmergency));
  EXPECT_FALSE(reads(kAtLimit));
  std::vector<bool> bounces;
  for (int i = 0; i < 40; ++i) bounces.insert(bounces.end(), {true, false});
  board_.drive_burst(kEmergencyStop, bounces);
  EXPECT_TRUE(reads(kEmergency));
  EXPECT_FALSE(reads(kEmergency));
  // Debounced, but there were too many changes to judge.
  bounces.push_back(true);
  board_.drive_burst(kLimit, bounces);
  EXPECT_TRUE(reads(kAtLimit));
}

TEST_F(GpiodLines, APressDuringALongFitOfBouncesIsActiveAfterIt) {
  open();
  EXPECT_FALSE(reads(kEmergency));
  std::vector<bool> bounces;
  for (int i = 0; i < 40; ++i) bounces.insert(bounces.end(), {true, false});
  bounces.push_back(true);  // and stays: the kernel has dropped this change
  board_.drive_burst(kEmergencyStop, bounces);
  EXPECT_TRUE(reads(kEmergency));
  EXPECT_TRUE(reads(kEmergency));
}

TEST_F(GpiodLines, ADebouncedInputIgnoresAGlitchAndSeesAPress) {
  open();
  EXPECT_FALSE(reads(kAtLimit));
  board_.drive_burst(kLimit, {false, true});
  EXPECT_FALSE(reads(kAtLimit));
  board_.drive_for(kLimit, false, milliseconds(4));
  EXPECT_FALSE(reads(kAtLimit));
  board_.drive_for(kLimit, false, milliseconds(5));
  EXPECT_TRUE(reads(kAtLimit));
  EXPECT_FALSE(reads(kAtLimit));
}

TEST_F(GpiodLines, WhatIsActiveWhenTheModuleOpensIsActive) {
  board_.drive(kEmergencyStop, true);
  board_.drive(kLimit, false);
  open();
  EXPECT_TRUE(reads(kEmergency));
  open();
  EXPECT_TRUE(reads(kAtLimit));  // debounced: nobody knows since when
}

TEST_F(GpiodLines, AnInputWhoseChangesAreNotToldIsPolled) {
  open(
      fmt::format("chip = 'unix:{}'\npoll_ms = 1\n[input.a]\noffset = 0\nedges = 'polled'\n"
                  "[input.b]\noffset = 1\n[output.c]\noffset = 5\n",
                  board_.path().string()));
  EXPECT_FALSE(reads(0));
  board_.drive(kEmergencyStop, true);
  board_.await_looks(kEmergencyStop, 2);
  board_.drive(kEmergencyStop, false);
  board_.await_looks(kEmergencyStop, 2);
  EXPECT_TRUE(reads(0));
  EXPECT_FALSE(reads(0));
  board_.drive(kEmergencyStop, true);
  EXPECT_TRUE(reads(0));
  ASSERT_TRUE(lines().set("c", true));
  EXPECT_TRUE(board_.high(kSpare));
  board_.cut();
  EXPECT_EQ(lines().read().error().code, ErrorCode::lost);
  board_.restore();
  wait_until_back();
  EXPECT_TRUE(reads(0));
}

TEST_F(GpiodLines, TheLightsLookTakesNoPressFromTheLines) {
  open();
  EXPECT_FALSE(reads(kEmergency));
  board_.drive_burst(kEmergencyStop, {true, false});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(light().state());
  EXPECT_TRUE(reads(kEmergency));
  EXPECT_FALSE(reads(kEmergency));
}

TEST_F(GpiodLines, OutputsAreReadBackFromThePin) {
  open();
  ASSERT_TRUE(lines().set("spare", true));
  EXPECT_TRUE(reads(index_of("spare")));
  board_.drive(kSpare, false);  // a short circuit
  EXPECT_FALSE(reads(index_of("spare")));
  board_.drive(kSpare, std::nullopt);
  EXPECT_TRUE(reads(index_of("spare")));
}

TEST_F(GpiodLines, AnOutputThatDoesNotFollowIsAFault) {
  open();
  board_.drive(kSpare, false);
  const auto set = lines().set("spare", true);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::device);
  EXPECT_THAT(set.error().text(), HasSubstr("line spare: the line was set active and reads inactive"));
  EXPECT_TRUE(lines().set("spare", false));
}

TEST_F(GpiodLines, AnOpenDrainLineMayBeHeldByOthers) {
  open(fmt::format("chip = 'unix:{}'\n[output.a]\noffset = 5\nactive = 'low'\ndrive = 'open-drain'\n",
                   board_.path().string()));
  EXPECT_TRUE(board_.high(kSpare));
  ASSERT_TRUE(lines().set("a", true));
  EXPECT_FALSE(board_.high(kSpare));
  board_.drive(kSpare, false);
  EXPECT_TRUE(lines().set("a", false));
  EXPECT_TRUE(reads(0));
}

TEST_F(GpiodLines, APulseFallsBackByItself) {
  open();
  (void)board_.changes(kTrigger);
  ASSERT_TRUE(lines().set("trigger", true));
  EXPECT_FALSE(board_.high(kTrigger));
  const auto changes = board_.changes(kTrigger);
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_TRUE(changes[0].high);
  EXPECT_FALSE(changes[1].high);
  EXPECT_GE(changes[1].at - changes[0].at, std::chrono::microseconds(2000));
  ASSERT_TRUE(lines().set("trigger", false));
  EXPECT_TRUE(board_.changes(kTrigger).empty());
}

TEST_F(GpiodLines, LinesThatAreNoOutputsCannotBeSet) {
  open();
  for (const char* name : {"emergency_stop", "nothing"}) {
    const auto set = lines().set(name, true);
    ASSERT_FALSE(set) << name;
    EXPECT_EQ(set.error().code, ErrorCode::bad_input);
  }
}

TEST_F(GpiodLines, AChipThatIsNotThereIsAnError) {
  board_.cut();
  const auto opened = bench_.open();
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().text(), HasSubstr(board_.path().string()));
}

TEST_F(GpiodLines, ALineThatIsTakenOrMissingIsAnErrorWithItsName) {
  open();
  const auto again = bench_.open();
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().text(), HasSubstr("the line is not to be had"));
  close();
  const std::string chip = fmt::format("chip = 'unix:{}'\n", board_.path().string());
  const auto no_name = bench_.open_with(chip + "[input.a]\nline = 'NONE'\n");
  ASSERT_FALSE(no_name);
  EXPECT_THAT(no_name.error().text(), HasSubstr("line a: the chip has no line with the name 'NONE'"));
  const auto beyond = bench_.open_with(chip + "[input.a]\noffset = 9\n");
  ASSERT_FALSE(beyond);
  EXPECT_THAT(beyond.error().text(), HasSubstr("line a"));
  const auto twice = bench_.open_with(chip + "[input.a]\noffset = 1\n[output.b]\nline = 'LIMIT'\n");
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().text(), HasSubstr("two names for one line"));
}

TEST_F(GpiodLines, AKernelChipThatIsNotThereIsAnErrorWithWhatThereIs) {
  const auto opened = bench_.open_with("chip = 'no-such-label'\n[input.a]\noffset = 1\n");
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().text(), HasSubstr("no-such-label"));
  const auto by_path = bench_.open_with("chip = '/dev/no-such-chip'\n[input.a]\noffset = 1\n");
  ASSERT_FALSE(by_path);
  EXPECT_THAT(by_path.error().text(), HasSubstr("/dev/no-such-chip: cannot open the chip of lines"));
  const auto no_chip = bench_.open_with("chip = '/dev/null'\n[input.a]\noffset = 1\n");
  ASSERT_FALSE(no_chip);
  EXPECT_THAT(no_chip.error().text(), HasSubstr("/dev/null"));
}

TEST_F(GpiodLines, ALostChipComesBackAtItsLevelsOfStart) {
  open();
  ASSERT_TRUE(lines().set("spare", true));
  ASSERT_TRUE(lines().set("shutter", true));
  board_.cut();
  const auto gone = lines().read();
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, ErrorCode::lost);
  EXPECT_EQ(lines().set("spare", false).error().code, ErrorCode::lost);
  board_.restore();
  wait_until_back();
  EXPECT_FALSE(reads(index_of("spare")));
  EXPECT_FALSE(board_.high(kSpare));
  EXPECT_TRUE(board_.is_output(kShutter));
  EXPECT_TRUE(board_.high(kShutter));
}

TEST_F(GpiodLines, AChipThatFailsIsLostAndItsOutputsAreAtRest) {
  open();
  ASSERT_TRUE(lines().set("spare", true));
  board_.fail_next(1, EIO);
  const auto failed = lines().read();
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::lost);
  EXPECT_FALSE(board_.high(kSpare));
  wait_until_back();
  for (const char* nonsense : {"hello", "ok 7", "ok 1@", ""}) {
    board_.garble_next(1, nonsense);
    const auto read = lines().read();
    ASSERT_FALSE(read) << nonsense;
    EXPECT_EQ(read.error().code, ErrorCode::lost) << nonsense;
    wait_until_back();
  }
}

TEST_F(GpiodLines, EveryReaderIsToldOnceThatTheChipWasAway) {
  open();
  ASSERT_TRUE(light().set_level(1));
  ASSERT_TRUE(light().state().value().on);
  board_.cut();
  EXPECT_FALSE(lines().read());
  board_.restore();
  wait_until_back();
  EXPECT_TRUE(lines().read());
  const auto told = light().state();
  ASSERT_FALSE(told);
  EXPECT_EQ(told.error().code, ErrorCode::lost);
  EXPECT_THAT(told.error().text(), HasSubstr("was away and is back"));
  const auto now = light().state();
  ASSERT_TRUE(now) << now.error().text();
  EXPECT_FALSE(now->on);
}

TEST_F(GpiodLines, APressBeforeTheChipWasLostIsTold) {
  open();
  EXPECT_FALSE(reads(kEmergency));
  board_.drive_burst(kEmergencyStop, {true, false});
  ASSERT_TRUE(light().state());  // looks at every line
  board_.cut();
  EXPECT_FALSE(lines().read());
  board_.restore();
  std::vector<bool> levels;
  for (int tries = 0; tries < 500 && levels.empty(); ++tries) {
    if (auto read = lines().read()) levels = *read;
    std::this_thread::sleep_for(milliseconds(10));
  }
  ASSERT_FALSE(levels.empty());
  EXPECT_TRUE(levels[kEmergency]);
}

TEST_F(GpiodLines, TheLightIsItsRelayAndItsShutter) {
  open();
  const auto can = light().capabilities();
  EXPECT_TRUE(can.has_shutter);
  EXPECT_FALSE(can.has_level);
  auto state = light().state().value();
  EXPECT_FALSE(state.on);
  EXPECT_FALSE(state.shutter_open);
  ASSERT_TRUE(light().set_level(1));
  EXPECT_TRUE(board_.high(kLamp));
  ASSERT_TRUE(light().set_shutter(true));
  EXPECT_FALSE(board_.high(kShutter));
  state = light().state().value();
  EXPECT_TRUE(state.on);
  EXPECT_TRUE(state.shutter_open);
  EXPECT_EQ(state.level, 1);
  EXPECT_TRUE(state.warm);  // it needs no time
  EXPECT_EQ(light().set_level(0.5).error().code, ErrorCode::bad_input);
  ASSERT_TRUE(light().set_level(0));
  EXPECT_FALSE(board_.high(kLamp));
  close();
  EXPECT_TRUE(std::filesystem::exists(bench_.state_folder() / "light.hours"));
}

}  // namespace
}  // namespace rig::drivers::gpiod_lines
