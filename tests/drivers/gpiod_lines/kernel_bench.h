// The bench of gpiod_lines on a gpiochip of the kernel: a CP2112 that is simulated at the other end of its
// USB. It needs root and the virtual USB host controller, which there is in the machine of tests/kernel.
#pragma once

#include <memory>
#include <string>

#include "drivers/api/module.h"
#include "drivers/conformance/bench.h"
#include "sim/wire/cp2112.h"
#include "sim/wire/vhci.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::gpiod_lines {

/// Whether this machine has what the bench needs.
[[nodiscard]] bool has_virtual_usb();

class KernelBench final : public conformance::Bench,
                          private conformance::Wire,
                          private conformance::LinesPeer,
                          private conformance::LightPeer {
 public:
  static constexpr unsigned int kEmergencyStop = 0, kLamp = 2, kShutter = 3, kTrigger = 4, kSpare = 5;

  KernelBench();
  /// Waits until the kernel has given up the chip: the next bench would find it otherwise.
  ~KernelBench() override;
  KernelBench(const KernelBench&) = delete;
  KernelBench& operator=(const KernelBench&) = delete;

  [[nodiscard]] std::string name() const override { return "gpiod_lines_kernel"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override;
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override;
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override;
  [[nodiscard]] conformance::Wire& wire() override { return *this; }
  [[nodiscard]] std::optional<conformance::LightUnderTest> light() override;
  [[nodiscard]] std::optional<conformance::LinesUnderTest> lines() override;

  /// [module.settings] for the chip: emergency_stop (with these keys), lamp, shutter, trigger, spare and the
  /// light.
  [[nodiscard]] static std::string settings(const std::string& emergency_stop = "edges = 'polled'");
  [[nodiscard]] base::Result<std::vector<Device>> open_with(const std::string& settings);
  [[nodiscard]] sim::wire::Cp2112& chip() { return chip_; }
  void plug_in();
  /// Returns when the kernel has taken the chip away.
  void unplug();

 private:
  bool cut() override;
  bool restore() override;
  void set_input(const std::string& line, bool active) override;
  [[nodiscard]] bool output(const std::string& line) override;
  [[nodiscard]] double level() override;

  test::TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  const ModuleEntry* module_ = nullptr;
  sim::wire::Cp2112 chip_{"00801234"};
  std::unique_ptr<sim::wire::VhciPlug> plug_;
};

}  // namespace rig::drivers::gpiod_lines
