// The report: one self-contained HTML page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::report {

struct Options {
  std::filesystem::path observation;
  std::vector<std::filesystem::path> maps;  ///< the first is the one shown; the others stand beside it
  std::filesystem::path truth;              ///< empty: none
  std::filesystem::path out;
  int views = 5;  ///< shown, from those held out of the fit
};

/// A figure with the limit it is held against.
struct Figure {
  std::string name;
  double value = 0, limit = 0;
  bool at_least = false;  ///< the limit is a lower bound
  [[nodiscard]] bool met() const { return at_least ? value >= limit : value <= limit; }
};

/// Writes the page; returns the figures that can be judged.
[[nodiscard]] base::Result<std::vector<Figure>> write_report(const Options& options);

}  // namespace rig::report
