#include "core/base/config_edit.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "core/base/toml.h"

namespace rig::base {

namespace {

std::string shown(const std::vector<std::string>& path) {
  return fmt::format("{}", fmt::join(path, "."));
}

tl::unexpected<Error> at_fault(std::string what, const std::vector<std::string>& path,
                               std::string hint = {}) {
  return fail(ErrorCode::bad_input, std::move(what), shown(path), std::move(hint));
}

Result<toml::table> parse(std::string_view text) {
  toml::parse_result parsed = toml::parse(text);
  if (parsed) return std::move(parsed).table();
  const auto& error = parsed.error();
  return fail(ErrorCode::bad_input, std::string(error.description()),
              fmt::format("line {}, column {}", error.source().begin.line, error.source().begin.column));
}

// In double quotes where it is a text, escaped as needed.
std::string written(const toml::node& node) {
  std::ostringstream out;
  out << toml::toml_formatter(
      node, toml::toml_formatter::default_flags & ~toml::format_flags::allow_literal_strings);
  return out.str();
}

std::string written(const TomlScalar& value) {
  if (const auto* number = std::get_if<double>(&value)) {
    // The shortest text that reads back as this number, and as one with a fraction.
    std::string out = fmt::format("{}", *number);
    return out.find_first_of(".ein") == std::string::npos ? out + ".0" : out;
  }
  return std::visit([](const auto& plain) { return written(toml::value(plain)); }, value);
}

std::string written_key(const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return (c < 0x80 && std::isalnum(c) != 0) || c == '_' || c == '-';
  });
  return bare ? key : written(toml::value<std::string>(key));
}

void put(toml::table& table, const std::string& key, const TomlScalar& value) {
  std::visit([&](const auto& plain) { table.insert_or_assign(key, plain); }, value);
}

// The table of an array of tables that `selector`, "name=virtual", means.
toml::table* selected(toml::array& tables, const std::string& selector) {
  const auto equals = selector.find('=');
  if (equals == std::string::npos) return nullptr;
  for (toml::node& item : tables) {
    toml::table* table = item.as_table();
    if (table == nullptr) continue;
    const auto name = (*table)[selector.substr(0, equals)].value<std::string_view>();
    if (name && *name == selector.substr(equals + 1)) return table;
  }
  return nullptr;
}

Result<toml::table*> table_of(toml::table& root, const std::vector<std::string>& path) {
  toml::table* table = &root;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const std::vector<std::string> so_far(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    toml::node* next = table->get(path[i]);
    if (next == nullptr) return at_fault("there is no such table", so_far);
    if (toml::array* array = next->as_array()) {
      if (i + 2 >= path.size())
        return at_fault("is an array of tables", so_far, "say which one, as name=TEXT");
      table = selected(*array, path[++i]);
      if (table == nullptr) return at_fault(fmt::format("there is none with {}", path[i]), so_far);
    } else if (toml::table* inner = next->as_table()) {
      table = inner;
    } else {
      return at_fault("is no table", so_far);
    }
  }
  return table;
}

// Byte of a place that toml++ names; its columns count code points.
std::size_t offset_of(std::string_view text, const toml::source_position& place) {
  std::size_t at = 0;
  for (toml::source_index line = 1; line < place.line && at != std::string_view::npos; ++line) {
    at = text.find('\n', at);
    if (at != std::string_view::npos) ++at;
  }
  if (at == std::string_view::npos) return text.size();
  for (toml::source_index column = 1; column < place.column && at < text.size(); ++column) {
    do ++at;
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80);
  }
  return at;
}

bool has_its_own_header(const toml::node& node) {
  return node.is_array_of_tables() || (node.is_table() && !node.as_table()->is_inline());
}

// Behind the last value of the table, on a line of its own that begins as that one does.
std::string added_below(std::string_view text, const toml::table& table, bool is_root,
                        const std::string& line) {
  toml::source_position first = table.source().begin;
  toml::source_position last = table.source().begin;
  bool empty = true;
  for (const auto& [key, node] : table) {
    if (has_its_own_header(node) || node.source().end.line < last.line) continue;
    first = key.source().begin;
    last = node.source().end;
    empty = false;
  }
  const std::size_t row = offset_of(text, {first.line, 1});
  const std::string_view indent = text.substr(row, text.find_first_not_of(" \t", row) - row);
  const std::size_t end = text.find('\n', offset_of(text, last));
  const bool ends_with_line = end != std::string_view::npos;
  const std::string_view newline = ends_with_line && end > 0 && text[end - 1] == '\r' ? "\r\n" : "\n";
  // The root has no header to stand below.
  const bool at_top = empty && is_root;
  const std::size_t at = at_top ? 0 : ends_with_line ? end + 1 : text.size();
  std::string out(text.substr(0, at));
  if (!at_top && !ends_with_line) out += newline;
  out += indent;
  return out + line + std::string(newline) + std::string(text.substr(at));
}

std::string added_inline(std::string_view text, const toml::table& table, const std::string& line) {
  const std::size_t brace = offset_of(text, table.source().end) - 1;
  const std::size_t last = text.find_last_not_of(" \t", brace - 1);
  std::string out(text.substr(0, last + 1));
  out += (table.empty() ? " " : ", ") + line;
  return out + (table.empty() || last + 1 < brace ? " " : "") + std::string(text.substr(brace));
}

}  // namespace

Result<std::string> edit_toml_value(std::string_view text, const std::vector<std::string>& path,
                                    const TomlScalar& value) {
  if (path.empty()) return fail(ErrorCode::bad_input, "no key was named");
  if (const auto* number = std::get_if<double>(&value); number != nullptr && !std::isfinite(*number))
    return at_fault("is to become no number", path);
  auto root = parse(text);
  if (!root) return pass(root);
  const auto table = table_of(*root, path);
  if (!table) return pass(table);
  const toml::node* old = (*table)->get(path.back());
  std::string out;
  if (old != nullptr) {
    if (old->is_table() || old->is_array()) return at_fault("is not a single value", path);
    const std::size_t begin = offset_of(text, old->source().begin);
    const std::size_t end = offset_of(text, old->source().end);
    out = std::string(text.substr(0, begin)) + written(value) + std::string(text.substr(end));
  } else {
    const std::string line = written_key(path.back()) + " = " + written(value);
    out = (*table)->is_inline() ? added_inline(text, **table, line)
                                : added_below(text, **table, *table == &*root, line);
  }
  put(**table, path.back(), value);
  const auto again = parse(out);
  // A table that only the header of another one names, or that dotted keys make, has no end to add to.
  if (!again || *again != *root)
    return at_fault("cannot be set in the text as it is", path, "write it by hand");
  return out;
}

}  // namespace rig::base
