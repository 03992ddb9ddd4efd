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
};

struct Check {
  std::string name;  ///< "abort during a move"
  std::function<Outcome(Bench&)> run;
};

/// All checks, in the order of the table; those of other kinds of device answer `none`.
[[nodiscard]] const std::vector<Check>& checks();

/// Resets the bench and runs one check; an exception of the module or the check is `failed`.
[[nodiscard]] Outcome run_check(Bench& bench, const Check& check);

/// One module's column: a line per check, "name<tab>verdict<tab>text", in `folder`/<module>.txt, replaced
/// whole. `./dev conformance` puts the columns together.
[[nodiscard]] base::Result<void> write_column(const std::filesystem::path& folder, const std::string& module,
                                              const std::vector<std::pair<Check, Outcome>>& outcomes);

/// The table of every column in `folder`, as Markdown: a row per check, a column per module, and below it
/// what was not proven or failed and why.
[[nodiscard]] base::Result<std::string> table_of(const std::filesystem::path& folder);

}  // namespace rig::drivers::conformance
