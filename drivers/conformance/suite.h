// The checks that every driver module must pass, and the table that they fill.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "drivers/conformance/bench.h"

namespace rig::drivers::conformance {

enum class Verdict {
  passed,
  failed,
  not_proven,  ///< this bench cannot show it
  none,        ///< does not concern such a device
};

struct Outcome {
  Verdict verdict = Verdict::passed;
  std::string text;  ///< why it failed or is not proven
  /// Failed by what must never be, however busy the machine is: a wrong frame, a stop that never came. No
  /// further try takes that back.
  bool for_good = false;
};

struct Check {
  std::string name;  ///< "abort during a move"
  std::function<Outcome(Bench&)> run;
};

/// All checks, in the order of the table; those of other kinds of device answer `none`.
[[nodiscard]] const std::vector<Check>& checks();

/// Resets the bench and runs one check; an exception of the module or the check is `failed`.
[[nodiscard]] Outcome run_check(Bench& bench, const Check& check);

/// Whether a column's line of before counts: that of an earlier try in the same run does.
enum class Earlier { forgotten, counts };

/// One module's column: a line per check, "name<tab>verdict<tab>tries<tab>text", in `folder`/<module>.tsv,
/// replaced whole. Answers what the lines say now. With Earlier::counts a check that has failed for good
/// stays so, and one that passes after it failed keeps the number of tries and why it failed. `./dev
/// conformance` puts the columns together.
[[nodiscard]] base::Result<std::vector<Outcome>> write_column(
    const std::filesystem::path& folder, const std::string& module,
    const std::vector<std::pair<Check, Outcome>>& outcomes, Earlier earlier = Earlier::forgotten);

/// The table of every column in these folders, as Markdown: a row per check, a column per module, and below
/// it what was not proven, failed, or passed at a further try only, and why. A folder that is not there
/// counts as empty, but one must be.
[[nodiscard]] base::Result<std::string> table_of(const std::vector<std::filesystem::path>& folders);

}  // namespace rig::drivers::conformance
