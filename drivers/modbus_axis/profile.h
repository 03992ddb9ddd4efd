// A drive as a file describes it (share/drives/*.toml): registers, units, sequences, what its status means.
// docs/drivers/modbus_axis.md is the reference of the language.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "drivers/modbus_axis/flags.h"
#include "drivers/modbus_axis/numbers.h"
#include "drivers/modbus_axis/steps.h"
#include "drivers/modbus_axis/words.h"

namespace rig::drivers::modbus {

/// Which of the protocol's two tables of words a register stands in (function 03 or 04).
enum class Table { holding, input };

struct Register {
  std::string name;
  Number address;
  Table table = Table::holding;
  Format format;
  Factor factor;  ///< from what stands there to counts or degrees Celsius

  [[nodiscard]] std::size_t words() const { return words_of(format.type); }
  [[nodiscard]] std::uint16_t at(const OptionValues& options) const {
    return static_cast<std::uint16_t>(address.value(options));
  }
};

/// What the drive's factory settings of the line are.
struct LineDefaults {
  int baud = 9600;
  char parity = 'N';
  int stop_bits = 1;
  int gap_ms = 0;                ///< silence before a request beyond the protocol's 3.5 characters
  bool one_word_single = false;  ///< a single word is written with function 06, else with 16
};

/// When a motion counts as over; MotionWatch says what each is for. `enable_ms`: how long enabling
/// waits for the drive to be energised.
struct MotionTimes {
  int take_ms = 100;
  int finish_ms = 500;
  int still_ms = 50;
  double tolerance_counts = 1;
  int enable_ms = 200;
};

struct Profile {
  std::string name;  ///< "Leadshine EM2RS and CS-RS, PR mode"
  LineDefaults line;
  std::vector<Option> options;
  std::vector<Register> registers;
  std::vector<Value> values;

  std::size_t position = 0;  ///< register with the readback
  std::optional<std::size_t> temperature, alarm;
  Flag fault, enabled, homed;
  std::optional<Flag> moving, complete;  ///< at least one of them
  Flag low_limit, high_limit;            ///< of the drive's own counting
  bool keeps_position_unpowered = false;
  bool replaces_moves = true;  ///< a move may be given while another runs
  std::map<std::int64_t, std::string> alarms;
  MotionTimes motion;

  /// Registers that must hold what is written here; compared, never written.
  std::vector<Step> expect;
  std::vector<Step> setup, enable, disable, clear_alarm, home, move, stop, soft_limits;
  /// By a distance; empty: by `move`, to where the distance ends. The one sequence that is not sent twice.
  std::vector<Step> jog;
};

/// Every mistake is an error with file, line and key; `name` stands for the file.
[[nodiscard]] base::Result<Profile> parse_profile(std::string_view text, const std::string& name);

/// The file of a profile: a path (with a slash), or a name, which is looked for as drives/<name>.toml in
/// ../share/rigd and ../../../share beside the running program.
[[nodiscard]] base::Result<std::filesystem::path> find_profile(const std::string& profile);

}  // namespace rig::drivers::modbus
