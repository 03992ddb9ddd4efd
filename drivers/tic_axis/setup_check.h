// Whether a Tic is set up as rig.toml says and as the driver needs it. The Tic's own settings are never
// changed silently: what does not agree is an error that says how to mend it, or is written where rig.toml
// asks for that (write_settings).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "drivers/tic_axis/link.h"
#include "drivers/tic_axis/settings.h"

namespace rig::drivers::tic {

struct Mismatch {
  std::string what;  ///< "step_mode is 1 in the Tic, 8 in rig.toml"
  std::string mend;  ///< "step_mode: 8", a line of the Tic's settings file; empty: see `what`
  /// Offsets and bytes of the setting, where the driver may write it.
  std::vector<std::pair<std::uint16_t, std::uint8_t>> bytes = {};
};

/// All that does not agree.
[[nodiscard]] std::vector<Mismatch> compare_setup(const TicSettings& wanted, const Identity& identity,
                                                  const Settings& is, const Variables& now);

/// One text: what does not agree, and the commands that mend it. Empty where nothing is.
[[nodiscard]] std::string mismatch_text(const std::vector<Mismatch>& mismatches, const std::string& serial);

/// Writes what may be written and makes the Tic load it; true: something was. Refused while the motor turns.
/// The Tic is out of its reference then.
[[nodiscard]] base::Result<bool> write_mismatches(Link& link, const std::vector<Mismatch>& mismatches,
                                                  const Variables& now);

}  // namespace rig::drivers::tic
