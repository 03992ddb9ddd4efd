#include "clients/import/text_rows.h"

#include <charconv>
#include <cmath>
#include <sstream>

#include "core/base/files.h"

namespace rig::import {

using base::ErrorCode;
using base::fail;
using base::Result;

Result<std::vector<TextRow>> read_text_rows(const std::filesystem::path& file) {
  const auto text = base::read_file(file);
  if (!text) return base::pass(text);
  std::vector<TextRow> rows;
  std::istringstream lines(*text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    for (char& c : line) {
      if (c == ',' || c == '\r' || c == '\t') c = ' ';
    }
    TextRow row{number, {}};
    std::istringstream words(line);
    for (std::string word; words >> word;) row.words.push_back(word);
    if (!row.words.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

Result<std::vector<double>> numbers_of(const TextRow& row, std::size_t first, std::size_t count,
                                       const std::filesystem::path& file) {
  const std::string where = fmt::format("{}:{}", file.string(), row.line);
  if (row.words.size() != first + count) {
    return fail(ErrorCode::bad_input,
                fmt::format("has {} values, {} belong there", row.words.size(), first + count), where);
  }
  std::vector<double> numbers;
  for (std::size_t i = first; i < row.words.size(); ++i) {
    const std::string& word = row.words[i];
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      return fail(ErrorCode::bad_input, fmt::format("'{}' is not a number", word), where);
    }
    numbers.push_back(value);
  }
  return numbers;
}

}  // namespace rig::import
