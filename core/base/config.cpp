#include "core/base/config.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "core/base/files.h"
#include "core/base/toml.h"

namespace rig::base {

struct ConfigTable::Node {
  const toml::table* table = nullptr;
  std::string path;                              // "axis.pan", for messages
  mutable std::set<std::string> read;            // keys somebody asked for
  mutable std::map<std::string, Node> children;  // made on demand, stable addresses
  mutable bool left_to_others = false;
};

struct ConfigTable::Document {
  std::string name;
  toml::table root;
  toml::table empty;
  Node node;
  std::vector<std::string> errors;

  [[nodiscard]] std::string place(const toml::node* at, const std::string& path) const {
    std::string out = name;
    if (at != nullptr && at->source().begin.line > 0) {
      out += fmt::format(":{}:{}", at->source().begin.line, at->source().begin.column);
    }
    return path.empty() ? out : out + ": " + path;
  }

  const Node& child(const Node& parent, const std::string& id, const std::string& path,
                    const toml::table* table) {
    Node& made = parent.children[id];
    made.table = table;
    made.path = path;
    return made;
  }
};

namespace {

std::string join(const std::string& path, std::string_view key) {
  if (path.empty()) return std::string(key);
  return key.empty() ? path : fmt::format("{}.{}", path, key);
}

// Levenshtein distance, for "did you mean".
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t up = row[j + 1];
      row[j + 1] = std::min({up + 1, row[j] + 1, diagonal + (a[i] == b[j] ? 0 : 1)});
      diagonal = up;
    }
  }
  return row.back();
}

std::string nearest(std::string_view word, const std::set<std::string>& known) {
  const auto closer = [word](const std::string& a, const std::string& b) {
    return distance(word, a) < distance(word, b);
  };
  const auto best = std::min_element(known.begin(), known.end(), closer);
  if (best == known.end() || distance(word, *best) > std::max<std::size_t>(2, word.size() / 3)) return {};
  return fmt::format("did you mean '{}'?", *best);
}

std::string list(const std::vector<std::string>& words) {
  return fmt::format("'{}'", fmt::join(words, "', '"));
}

}  // namespace

ConfigTable::ConfigTable(std::shared_ptr<Document> document, const Node* node)
    : document_(std::move(document)), node_(node) {}

Result<ConfigTable> ConfigTable::parse(std::string_view text, const std::string& name) {
  toml::parse_result parsed = toml::parse(text, name);
  if (!parsed) {
    const auto& error = parsed.error();
    return fail(ErrorCode::bad_input, std::string(error.description()),
                fmt::format("{}:{}:{}", name, error.source().begin.line, error.source().begin.column));
  }
  auto document = std::make_shared<Document>();
  document->name = name;
  document->root = std::move(parsed).table();
  document->node.table = &document->root;
  const Node* node = &document->node;
  return ConfigTable(std::move(document), node);
}

Result<ConfigTable> ConfigTable::parse_file(const std::string& path) {
  auto text = read_file(path);
  if (!text) return pass(text);
  return parse(*text, path);
}

bool ConfigTable::has(std::string_view key) const {
  const bool found = node_->table->contains(key);
  if (found) node_->read.emplace(key);
  return found;
}

std::vector<std::string> ConfigTable::keys() const {
  std::vector<std::pair<toml::source_position, std::string>> found;
  for (const auto& [key, value] : *node_->table)
    found.emplace_back(key.source().begin, std::string(key.str()));
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first.line, a.first.column) < std::pair(b.first.line, b.first.column);
  });
  std::vector<std::string> out;
  out.reserve(found.size());
  for (auto& [position, key] : found) out.push_back(std::move(key));
  return out;
}

void ConfigTable::error(std::string_view key, std::string what, std::string hint) const {
  const toml::node* at = key.empty() ? nullptr : node_->table->get(key);
  if (at == nullptr) at = node_->table;
  const Error made{ErrorCode::bad_input, std::move(what), document_->place(at, join(node_->path, key)),
                   std::move(hint)};
  document_->errors.push_back(made.text());
}

std::string ConfigTable::where(std::string_view key) const {
  const toml::node* at = key.empty() ? node_->table : node_->table->get(key);
  return document_->place(at != nullptr ? at : node_->table, join(node_->path, key));
}

void ConfigTable::leave_to_others() const {
  node_->left_to_others = true;
}

double ConfigTable::number(std::string_view key, Range range) const {
  node_->read.emplace(key);
  const toml::node* found = node_->table->get(key);
  if (found == nullptr) {
    error(key, "is missing", fmt::format("a number from {} to {}", range.low, range.high));
    return range.low;
  }
  const auto value = found->is_number() ? found->value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) {
    error(key, "must be a number", "write it without quotes");
    return range.low;
  }
  if (*value < range.low || *value > range.high) {
    error(key, fmt::format("is {}, outside {} to {}", *value, range.low, range.high));
    return range.low;
  }
  return *value;
}

double ConfigTable::number_or(std::string_view key, double fallback, Range range) const {
  node_->read.emplace(key);
  return node_->table->contains(key) ? number(key, range) : fallback;
}

std::int64_t ConfigTable::integer(std::string_view key, std::int64_t low, std::int64_t high) const {
  node_->read.emplace(key);
  const toml::node* found = node_->table->get(key);
  if (found == nullptr) {
    error(key, "is missing", fmt::format("a whole number from {} to {}", low, high));
    return low;
  }
  const auto value = found->is_integer() ? found->value<std::int64_t>() : std::nullopt;
  if (!value) {
    error(key, "must be a whole number");
    return low;
  }
  if (*value < low || *value > high) {
    error(key, fmt::format("is {}, outside {} to {}", *value, low, high));
    return low;
  }
  return *value;
}

std::int64_t ConfigTable::integer_or(std::string_view key, std::int64_t fallback, std::int64_t low,
                                     std::int64_t high) const {
  node_->read.emplace(key);
  return node_->table->contains(key) ? integer(key, low, high) : fallback;
}

bool ConfigTable::boolean_or(std::string_view key, bool fallback) const {
  node_->read.emplace(key);
  const toml::node* found = node_->table->get(key);
  if (found == nullptr) return fallback;
  if (!found->is_boolean()) {
    error(key, "must be true or false");
    return fallback;
  }
  return *found->value<bool>();
}

std::string ConfigTable::text(std::string_view key) const {
  node_->read.emplace(key);
  const toml::node* found = node_->table->get(key);
  if (found == nullptr) {
    error(key, "is missing", "a text in quotes");
    return {};
  }
  if (!found->is_string()) {
    error(key, "must be a text in quotes");
    return {};
  }
  return *found->value<std::string>();
}

std::string ConfigTable::text_or(std::string_view key, std::string_view fallback) const {
  node_->read.emplace(key);
  return node_->table->contains(key) ? text(key) : std::string(fallback);
}

std::string ConfigTable::choice(std::string_view key, const std::vector<std::string>& allowed) const {
  const std::size_t before = document_->errors.size();
  std::string value = text(key);
  if (document_->errors.size() == before &&
      std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    error(key, fmt::format("is '{}'", value), "one of " + list(allowed));
    return allowed.front();
  }
  return value;
}

std::string ConfigTable::choice_or(std::string_view key, std::string_view fallback,
                                   const std::vector<std::string>& allowed) const {
  node_->read.emplace(key);
  return node_->table->contains(key) ? choice(key, allowed) : std::string(fallback);
}

std::vector<double> ConfigTable::numbers(std::string_view key, std::size_t count, Range range) const {
  node_->read.emplace(key);
  std::vector<double> out(count, range.low);
  const toml::node* found = node_->table->get(key);
  const toml::array* array = found != nullptr ? found->as_array() : nullptr;
  if (array == nullptr || (count != 0 && array->size() != count)) {
    error(key, found == nullptr ? "is missing" : "has the wrong shape",
          count != 0 ? fmt::format("an array of {} numbers", count) : "an array of numbers");
    return out;
  }
  out.assign(array->size(), range.low);
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::node& item = *array->get(i);
    const auto value = item.is_number() ? item.value<double>() : std::nullopt;
    if (!value || !(*value >= range.low && *value <= range.high)) {
      error(key, fmt::format("item {} must be a number from {} to {}", i + 1, range.low, range.high));
      return out;
    }
    out[i] = *value;
  }
  return out;
}

std::vector<std::vector<double>> ConfigTable::rows(std::string_view key, std::size_t columns) const {
  node_->read.emplace(key);
  std::vector<std::vector<double>> out;
  const toml::node* found = node_->table->get(key);
  const toml::array* array = found != nullptr ? found->as_array() : nullptr;
  if (array == nullptr) {
    error(key, found == nullptr ? "is missing" : "must be an array of rows");
    return out;
  }
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::array* row = array->get(i)->as_array();
    std::vector<double> values;
    for (std::size_t j = 0; row != nullptr && j < row->size(); ++j) {
      const toml::node& item = *row->get(j);
      if (const auto value = item.is_number() ? item.value<double>() : std::nullopt;
          value && std::isfinite(*value)) {
        values.push_back(*value);
      }
    }
    if (row == nullptr || row->size() != columns || values.size() != columns) {
      error(key, fmt::format("row {} (line {}) must be {} numbers", i + 1, array->get(i)->source().begin.line,
                             columns));
      return out;
    }
    out.push_back(std::move(values));
  }
  return out;
}

std::vector<std::string> ConfigTable::texts(std::string_view key) const {
  node_->read.emplace(key);
  std::vector<std::string> out;
  const toml::node* found = node_->table->get(key);
  const toml::array* array = found != nullptr ? found->as_array() : nullptr;
  if (array == nullptr) {
    error(key, found == nullptr ? "is missing" : "must be an array of texts");
    return out;
  }
  for (const toml::node& item : *array) {
    const auto value = item.value<std::string>();
    if (!value) {
      error(key, fmt::format("item {} must be a text in quotes", out.size() + 1));
      return out;
    }
    out.push_back(*value);
  }
  return out;
}

ConfigTable ConfigTable::table(std::string_view key) const {
  if (auto found = table_if(key)) return *found;
  if (!node_->table->contains(key))
    error(key, "is missing", fmt::format("a table [{}]", join(node_->path, key)));
  const Node& none =
      document_->child(*node_, fmt::format("{}", key), join(node_->path, key), &document_->empty);
  return {document_, &none};
}

std::optional<ConfigTable> ConfigTable::table_if(std::string_view key) const {
  node_->read.emplace(key);
  const toml::node* found = node_->table->get(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_table()) {
    error(key, "must be a table");
    return std::nullopt;
  }
  const Node& child = document_->child(*node_, std::string(key), join(node_->path, key), found->as_table());
  return ConfigTable(document_, &child);
}

std::vector<ConfigTable> ConfigTable::tables(std::string_view key) const {
  node_->read.emplace(key);
  std::vector<ConfigTable> out;
  const toml::node* found = node_->table->get(key);
  if (found == nullptr) return out;
  const toml::array* array = found->as_array();
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    const toml::table* item = array->get(i)->as_table();
    if (item == nullptr) break;
    const std::string id = fmt::format("{}[{}]", key, i);
    out.push_back(ConfigTable(document_, &document_->child(*node_, id, join(node_->path, id), item)));
  }
  if (array == nullptr || out.size() != array->size()) {
    error(key, "must be an array of tables", fmt::format("[[{}]]", join(node_->path, key)));
  }
  return out;
}

std::size_t ConfigTable::errors() const {
  return document_->errors.size();
}

Result<void> ConfigTable::noted() const {
  if (document_->errors.empty()) return {};
  return fail(ErrorCode::bad_input, fmt::format("{}", fmt::join(document_->errors, "\n")));
}

Result<void> ConfigTable::finish() const {
  const auto visit = [this](const auto& self, const Node& node) -> void {
    if (node.left_to_others) return;
    for (const auto& [key, value] : *node.table) {
      if (node.read.count(std::string(key.str())) != 0) continue;
      const Error unknown{ErrorCode::bad_input, "unknown key",
                          fmt::format("{}:{}:{}: {}", document_->name, key.source().begin.line,
                                      key.source().begin.column, join(node.path, key.str())),
                          nearest(key.str(), node.read)};
      document_->errors.push_back(unknown.text());
    }
    for (const auto& [id, child] : node.children) self(self, child);
  };
  std::vector<std::string> noted = document_->errors;
  visit(visit, document_->node);
  std::vector<std::string> errors = std::exchange(document_->errors, std::move(noted));
  if (errors.empty()) return {};
  return fail(ErrorCode::bad_input, fmt::format("{}", fmt::join(errors, "\n")));
}

}  // namespace rig::base
