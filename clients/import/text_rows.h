// Lines of numbers, with every error placed. Private to import.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::import {

struct TextRow {
  int line = 0;  ///< from 1
  std::vector<std::string> words;
};

/// The lines of a text file as words separated by blanks or commas. Empty lines are left out.
[[nodiscard]] base::Result<std::vector<TextRow>> read_text_rows(const std::filesystem::path& file);

/// The words of a row from `first` on as exactly `count` finite numbers.
[[nodiscard]] base::Result<std::vector<double>> numbers_of(const TextRow& row, std::size_t first,
                                                           std::size_t count,
                                                           const std::filesystem::path& file);

}  // namespace rig::import
