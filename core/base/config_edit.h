// Changing one value in a TOML text that a person wrote: comments, order and spacing stay.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/result.h"

namespace rig::base {

using TomlScalar = std::variant<bool, std::int64_t, double, std::string>;

/// The text with the value at `path` replaced, or added at the end of its table where the table exists and
/// the key does not. `path`: a key each, from the root; the element after an array of tables says which one,
/// as "name=virtual" (the table whose `name` is that text). An Error where a table on the way does not exist,
/// where the path ends at a table or array, or where the text is no TOML. What is handed back differs in that
/// value alone: it was parsed again and compared.
[[nodiscard]] Result<std::string> edit_toml_value(std::string_view text, const std::vector<std::string>& path,
                                                  const TomlScalar& value);

}  // namespace rig::base
