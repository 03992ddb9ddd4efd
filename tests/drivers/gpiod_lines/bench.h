// The bench of gpiod_lines: the module as rigd loads it, and a board of lines behind a socket.
#pragma once

#include <memory>
#include <string>

#include "drivers/api/module.h"
#include "drivers/conformance/bench.h"
#include "sim/wire/line_board.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::gpiod_lines {

/// Offsets on the board.
inline constexpr unsigned int kEmergencyStop = 0, kLimit = 1, kLamp = 2, kShutter = 3, kTrigger = 4,
                              kSpare = 5;

/// [module.settings] for the board: emergency_stop and limit; lamp, shutter, trigger (pulse) and spare; the
/// light of lamp and shutter. `more` is put in front of the tables.
[[nodiscard]] std::string settings_for(const std::filesystem::path& socket, const std::string& more = "");

class LinesBench final : public conformance::Bench,
                         private conformance::Wire,
                         private conformance::LinesPeer,
                         private conformance::LightPeer {
 public:
  LinesBench();

  [[nodiscard]] std::string name() const override { return "gpiod_lines"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override;
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override;
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override;
  [[nodiscard]] conformance::Wire& wire() override { return *this; }
  [[nodiscard]] std::optional<conformance::LightUnderTest> light() override;
  [[nodiscard]] std::optional<conformance::LinesUnderTest> lines() override;

  /// Opens the module with other settings.
  [[nodiscard]] base::Result<std::vector<Device>> open_with(const std::string& settings);
  [[nodiscard]] sim::wire::LineBoard& board() { return board_; }
  [[nodiscard]] std::filesystem::path state_folder() const { return folder_.path(); }

 private:
  bool cut() override;
  bool restore() override;
  bool spoil(conformance::Spoil how, int answers) override;
  bool thin_out(int answers) override;
  void set_input(const std::string& line, bool active) override;
  [[nodiscard]] bool output(const std::string& line) override;
  [[nodiscard]] double level() override;

  test::TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  const ModuleEntry* module_ = nullptr;
  sim::wire::LineBoard board_;
};

}  // namespace rig::drivers::gpiod_lines
