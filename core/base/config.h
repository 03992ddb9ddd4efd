// TOML with its positions kept, so that every error names file, line, column and key, and a key nobody read
// is an error too. toml++ parses; nothing of it shows here.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace rig::base {

/// Closed interval of allowed values.
struct Range {
  double low;
  double high;
};

/// One table of a TOML document. Readers of a missing or wrong key note an error and return a neutral value,
/// so that one run reports every mistake; `finish` on the root tells. Copies share the document.
class ConfigTable {
 public:
  [[nodiscard]] static Result<ConfigTable> parse_file(const std::string& path);
  /// `name` stands for the file in messages.
  [[nodiscard]] static Result<ConfigTable> parse(std::string_view text, const std::string& name);

  [[nodiscard]] bool has(std::string_view key) const;
  /// Keys in the order of the document; asking for them marks none as read.
  [[nodiscard]] std::vector<std::string> keys() const;

  [[nodiscard]] double number(std::string_view key, Range range) const;
  [[nodiscard]] double number_or(std::string_view key, double fallback, Range range) const;
  [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t low, std::int64_t high) const;
  [[nodiscard]] std::int64_t integer_or(std::string_view key, std::int64_t fallback, std::int64_t low,
                                        std::int64_t high) const;
  [[nodiscard]] bool boolean_or(std::string_view key, bool fallback) const;
  [[nodiscard]] std::string text(std::string_view key) const;
  [[nodiscard]] std::string text_or(std::string_view key, std::string_view fallback) const;
  /// One of `allowed`, else an error that lists them.
  [[nodiscard]] std::string choice(std::string_view key, const std::vector<std::string>& allowed) const;
  [[nodiscard]] std::string choice_or(std::string_view key, std::string_view fallback,
                                      const std::vector<std::string>& allowed) const;
  /// An array of exactly `count` numbers (any number of them where count is 0), each in `range`.
  [[nodiscard]] std::vector<double> numbers(std::string_view key, std::size_t count, Range range) const;
  /// An array of arrays of `columns` numbers each.
  [[nodiscard]] std::vector<std::vector<double>> rows(std::string_view key, std::size_t columns) const;
  [[nodiscard]] std::vector<std::string> texts(std::string_view key) const;
  /// A table that must exist; an empty one (with the error noted) where it does not.
  [[nodiscard]] ConfigTable table(std::string_view key) const;
  [[nodiscard]] std::optional<ConfigTable> table_if(std::string_view key) const;
  /// The tables of an array of tables; none where the key is absent.
  [[nodiscard]] std::vector<ConfigTable> tables(std::string_view key) const;

  /// Notes an error at `key` (or at the table itself where key is empty), for rules beyond one value.
  void error(std::string_view key, std::string what, std::string hint = {}) const;

  /// "file:line:column table.key", for messages made elsewhere.
  [[nodiscard]] std::string where(std::string_view key = {}) const;

  /// Marks this table and all below it as read: for a part that somebody else will read (the settings of a
  /// driver).
  void leave_to_others() const;

  /// How many errors the whole document has noted so far, and all of them as one Error: for a reader of a
  /// part.
  [[nodiscard]] std::size_t errors() const;
  [[nodiscard]] Result<void> noted() const;

  /// Every error noted in the whole document and every key in it that nobody read, as one Error with a line
  /// each.
  [[nodiscard]] Result<void> finish() const;

 private:
  struct Document;
  struct Node;
  ConfigTable(std::shared_ptr<Document> document, const Node* node);

  std::shared_ptr<Document> document_;
  const Node* node_;
};

}  // namespace rig::base
