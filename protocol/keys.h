// CURVE keys and the files they are kept in. A key is written as 40 letters of Z85, ZeroMQ's alphabet.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace rig::protocol {

struct KeyPair {
  std::string public_key;  ///< may be known to everyone
  std::string secret_key;  ///< who has it is who it stands for
};

/// An Error where the system's ZeroMQ has no CURVE.
[[nodiscard]] base::Result<KeyPair> make_key_pair();

/// Whether the text is written like a key.
[[nodiscard]] bool is_key(std::string_view text);

/// Writes both keys to `path`, readable by its owner alone, and the public one to `path`.pub. Refuses where
/// one of them exists: a key that is overwritten is lost.
[[nodiscard]] base::Result<void> write_key_files(const std::filesystem::path& path, const KeyPair& keys);

/// Both keys from a file of write_key_files. An Error where others than its owner may read it, or where the
/// public key does not belong to the secret one.
[[nodiscard]] base::Result<KeyPair> read_key_file(const std::filesystem::path& path);

/// The key itself, or out of a .pub file that is named.
[[nodiscard]] base::Result<std::string> read_public_key(const std::string& key_or_file);

}  // namespace rig::protocol
