#include "protocol/role.h"

#include <algorithm>

namespace rig::protocol {

const std::vector<std::string>& role_names() {
  static const std::vector<std::string> names{"observer", "operator", "admin"};
  return names;
}

const std::string& role_name(Role role) {
  return role_names().at(static_cast<std::size_t>(role));
}

std::optional<Role> role_named(std::string_view name) {
  const auto& names = role_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Role>(found - names.begin());
}

}  // namespace rig::protocol
