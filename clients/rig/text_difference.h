// What changed between two texts, for a person.
#pragma once

#include <string>
#include <string_view>

namespace rig::client {

/// A unified difference, as diff -u writes it, with three lines around each change; empty where they are
/// equal.
[[nodiscard]] std::string unified_difference(std::string_view before, std::string_view after,
                                             const std::string& name_before, const std::string& name_after);

}  // namespace rig::client
