// The file that says which public keys may connect over the network, under which name and in which role.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "protocol/role.h"

namespace rig::protocol {

struct AllowedKey {
  std::string name;        ///< of the client, by which others know it; unique
  std::string public_key;  ///< Z85; unique
  Role role = Role::observer;
};

/// Whether a client may be called so: 1 to 64 letters, digits and ._@-
[[nodiscard]] bool is_client_name(std::string_view name);

/// Every mistake in one Error, with file, line and key.
[[nodiscard]] base::Result<std::vector<AllowedKey>> parse_allow_list(std::string_view text,
                                                                     const std::string& name);
[[nodiscard]] base::Result<std::vector<AllowedKey>> read_allow_list(const std::filesystem::path& path);

/// Replaces the file whole; comments in it are not kept.
[[nodiscard]] base::Result<void> write_allow_list(const std::filesystem::path& path,
                                                  const std::vector<AllowedKey>& keys);

/// Adds one to the file, which is made where it does not exist. Refused where its name or key is there.
[[nodiscard]] base::Result<void> allow_key(const std::filesystem::path& path, const AllowedKey& key);

/// Takes the client of that name, or with that key, off the file; which one it was.
[[nodiscard]] base::Result<AllowedKey> revoke_key(const std::filesystem::path& path,
                                                  const std::string& name_or_key);

}  // namespace rig::protocol
