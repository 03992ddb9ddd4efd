// `rig control` and `rig keys`: who commands the rig, and who may connect to it over the network.
#pragma once

#include <filesystem>
#include <string>

#include "clients/rig/commands.h"

namespace rig::client {

/// Who holds control and who else is there.
[[nodiscard]] Result<void> control_show(const Connection& to);
[[nodiscard]] Result<void> control_take(const Connection& to);
[[nodiscard]] Result<void> control_release(const Connection& to);
[[nodiscard]] Result<void> control_hand_over(const Connection& to, const std::string& client);

/// Makes a pair of keys: `file`, for its owner alone, and `file`.pub. Overwrites nothing.
[[nodiscard]] Result<void> keys_make(const std::filesystem::path& file);
[[nodiscard]] Result<void> keys_list(const std::filesystem::path& list);
/// `key`: a public key, or a .pub file. `role`: observer, operator or admin.
[[nodiscard]] Result<void> keys_allow(const std::filesystem::path& list, const std::string& name,
                                      const std::string& key, const std::string& role);
/// `name`: of the client, or its public key.
[[nodiscard]] Result<void> keys_revoke(const std::filesystem::path& list, const std::string& name);

}  // namespace rig::client
