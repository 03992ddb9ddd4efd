// gpiod_lines on the kernel's own GPIO, through libgpiod. Skipped where there is no virtual USB host
// controller.
#include <gmock/gmock.h>
#include <thread>

#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/gpiod_lines/kernel_bench.h"

namespace rig::drivers::gpiod_lines {
namespace {

using base::ErrorCode;
using testing::HasSubstr;

constexpr const char* kWhySkipped = "no virtual USB host controller (vhci-hcd); tests/kernel has one";

std::vector<std::size_t> checks_of_lines() {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < conformance::checks().size(); ++i) {
    const std::string& name = conformance::checks()[i].name;
    if (name.starts_with("lines") || name.starts_with("light")) numbers.push_back(i);
  }
  return numbers;
}

class KernelConformance : public conformance::ConformanceTest {};

TEST_P(KernelConformance, Passes) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  run(std::make_unique<KernelBench>(), conformance::checks()[GetParam()]);
}

INSTANTIATE_TEST_SUITE_P(GpiodLines, KernelConformance, testing::ValuesIn(checks_of_lines()),
                         conformance::test_name_of);

class KernelLines : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
    bench_ = std::make_unique<KernelBench>();
  }
  void open(const std::string& settings) {
    devices_.clear();
    auto opened = bench_->open_with(settings);
    ASSERT_TRUE(opened) << opened.error().text();
    devices_ = std::move(*opened);
  }
  DigitalIo& lines() { return *std::get<std::unique_ptr<DigitalIo>>(devices_.at(0).is); }
  bool reads(const std::string& name) {
    const auto all = lines().lines();
    const auto found = std::find_if(all.begin(), all.end(), [&](const Line& l) { return l.name == name; });
    const auto levels = lines().read();
    EXPECT_TRUE(levels) << levels.error().text();
    return levels.value().at(static_cast<std::size_t>(found - all.begin()));
  }
  sim::wire::Cp2112& chip() { return bench_->chip(); }

  std::unique_ptr<KernelBench> bench_;
  std::vector<Device> devices_;
};

TEST_F(KernelLines, AChangeThatTheKernelTellsIsSeenAfterwards) {
  open(KernelBench::settings("edges = 'told'"));
  EXPECT_FALSE(reads("emergency_stop"));
  chip().drive(KernelBench::kEmergencyStop, true);
  // hid-cp2112 looks at its inputs some 25 times a second and makes its interrupts from that.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  chip().drive(KernelBench::kEmergencyStop, false);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(reads("emergency_stop"));
  EXPECT_FALSE(reads("emergency_stop"));
}

TEST_F(KernelLines, ActiveLowIsTheKernels) {
  open(KernelBench::settings("edges = 'polled'\nactive = 'low'"));
  EXPECT_TRUE(reads("emergency_stop"));
  chip().drive(KernelBench::kEmergencyStop, true);
  EXPECT_TRUE(reads("emergency_stop"));
  EXPECT_FALSE(reads("emergency_stop"));
}

TEST_F(KernelLines, OutputsAreDrivenAndReadBackFromThePin) {
  open(KernelBench::settings());
  EXPECT_TRUE(chip().is_output(KernelBench::kShutter));
  EXPECT_TRUE(chip().high(KernelBench::kShutter));
  ASSERT_TRUE(lines().set("spare", true));
  EXPECT_TRUE(chip().high(KernelBench::kSpare));
  EXPECT_TRUE(reads("spare"));
  chip().drive(KernelBench::kSpare, false);
  EXPECT_FALSE(reads("spare"));
  const auto held = lines().set("spare", true);
  ASSERT_FALSE(held);
  EXPECT_EQ(held.error().code, ErrorCode::device);
}

TEST_F(KernelLines, ASetThatTheChipRefusedIsNotTakenForDone) {
  // An output alone: nobody else talks to the chip.
  open("chip = 'cp2112_gpio'\n[output.spare]\noffset = 5\n");
  chip().stall_next(1);
  EXPECT_FALSE(lines().set("spare", true));
  EXPECT_FALSE(chip().high(KernelBench::kSpare));
}

TEST_F(KernelLines, APulseFallsBackByItself) {
  open(KernelBench::settings());
  (void)chip().changes(KernelBench::kTrigger);
  ASSERT_TRUE(lines().set("trigger", true));
  const auto changes = chip().changes(KernelBench::kTrigger);
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_TRUE(changes[0].high);
  EXPECT_GE(changes[1].at - changes[0].at, std::chrono::milliseconds(4));
}

TEST_F(KernelLines, AnOutputThatIsKeptDoesNotMove) {
  const std::string keep =
      "chip = 'cp2112_gpio'\n[output.lamp]\noffset = 2\nactive = 'low'\nat_start = 'keep'\nat_exit = "
      "'keep'\n";
  open(keep);
  EXPECT_TRUE(chip().high(KernelBench::kLamp));
  ASSERT_TRUE(lines().set("lamp", true));
  devices_.clear();
  EXPECT_FALSE(chip().high(KernelBench::kLamp));
  (void)chip().changes(KernelBench::kLamp);
  open(keep);
  EXPECT_TRUE(reads("lamp"));
  EXPECT_TRUE(chip().changes(KernelBench::kLamp).empty());
  ASSERT_TRUE(lines().set("lamp", false));
  EXPECT_TRUE(chip().high(KernelBench::kLamp));
}

TEST_F(KernelLines, AnOpenDrainLineMayBeHeldByOthers) {
  open("chip = 'cp2112_gpio'\n[output.a]\noffset = 5\nactive = 'low'\ndrive = 'open-drain'\n");
  EXPECT_TRUE(chip().high(KernelBench::kSpare));
  ASSERT_TRUE(lines().set("a", true));
  EXPECT_FALSE(chip().high(KernelBench::kSpare));
  ASSERT_TRUE(lines().set("a", false));
  EXPECT_TRUE(chip().high(KernelBench::kSpare));
}

TEST_F(KernelLines, ALineThatSomebodyHasIsNamedWithWhoHasIt) {
  open(KernelBench::settings());
  const auto again = bench_->open();
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().text(), HasSubstr("'rigd' has the line"));
}

TEST_F(KernelLines, LinesThatTheChipHasNotAreErrors) {
  const auto beyond = bench_->open_with("chip = 'cp2112_gpio'\n[input.a]\noffset = 8\n");
  ASSERT_FALSE(beyond);
  EXPECT_THAT(beyond.error().text(), HasSubstr("line a: there is no line 8: the chip has 8"));
  const auto no_name = bench_->open_with("chip = 'cp2112_gpio'\n[input.a]\nline = 'GPIO4'\n");
  ASSERT_FALSE(no_name);
  EXPECT_THAT(no_name.error().text(), HasSubstr("no line with the name 'GPIO4'"));
}

}  // namespace
}  // namespace rig::drivers::gpiod_lines
