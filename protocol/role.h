// What a client may do.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rig::protocol {

/// `observer` may look and stop, `operator_` may command, `admin` may also take control from another.
enum class Role { observer, operator_, admin };

/// The roles' names in files and on command lines, in the order of the enumeration.
[[nodiscard]] const std::vector<std::string>& role_names();
[[nodiscard]] const std::string& role_name(Role role);
/// Nothing where no role has that name.
[[nodiscard]] std::optional<Role> role_named(std::string_view name);

}  // namespace rig::protocol
