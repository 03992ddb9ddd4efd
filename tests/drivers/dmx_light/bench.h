// The bench of dmx_light: the module as rigd loads it, and a widget at the other end of a line.
#pragma once

#include <memory>
#include <string>

#include "drivers/api/module.h"
#include "drivers/conformance/bench.h"
#include "sim/wire/dmx_pro.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::dmx_light {

inline constexpr const char* kSerial = "02301234";

class DmxBench final : public conformance::Bench, private conformance::Wire, private conformance::LightPeer {
 public:
  DmxBench();

  [[nodiscard]] std::string name() const override { return "dmx_light"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override;
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override;
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override;
  [[nodiscard]] conformance::Wire& wire() override { return *this; }
  [[nodiscard]] std::optional<conformance::LightUnderTest> light() override;

  /// [module.settings]: level on channels 1 and 2, shutter on 3, and `more` behind that.
  [[nodiscard]] std::string settings(const std::string& more = "") const;
  [[nodiscard]] base::Result<std::vector<Device>> open_with(const std::string& settings,
                                                            base::Clock* clock = nullptr);
  [[nodiscard]] sim::wire::DmxPro& widget() { return widget_; }
  [[nodiscard]] const test::TemporaryFolder& folder() const { return folder_; }

 private:
  bool cut() override;
  bool restore() override;
  bool spoil(conformance::Spoil how, int answers) override;
  bool thin_out(int answers) override;
  [[nodiscard]] double level() override;

  test::TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  const ModuleEntry* module_ = nullptr;
  sim::wire::DmxPro widget_;
};

/// What the module has logged, one line each.
std::vector<std::string>& logged();

}  // namespace rig::drivers::dmx_light
