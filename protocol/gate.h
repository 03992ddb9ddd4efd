// Who is at the network's door: answers ZeroMQ's question for each handshake (ZAP, RFC 27) and says for each
// message who sent it. Used by the server's thread alone. Private to protocol.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "protocol/allow_list.h"

namespace rig::protocol {

/// The domain under which rigd's socket asks; a request of another is denied.
inline constexpr std::string_view kZapDomain = "rigd";

class Gate {
 public:
  [[nodiscard]] static base::Result<Gate> open(const std::filesystem::path& allow_list);

  /// Reads the list again where the file changed; those who were on it and are no more. A list that cannot
  /// be read any more allows nobody.
  [[nodiscard]] std::vector<AllowedKey> refresh();

  /// The one with that public key; nullptr: nobody who is allowed.
  [[nodiscard]] const AllowedKey* find(std::string_view public_key) const;

  /// The answer to a request of ZAP. The user id of one who is let in is its public key.
  [[nodiscard]] std::vector<std::string> answer(const std::vector<std::string>& request) const;

 private:
  // What changes when a file is replaced or written.
  struct Stamp {
    std::int64_t modified_s = -1, modified_ns = -1, bytes = -1;
    std::uint64_t inode = 0;
    bool operator==(const Stamp&) const = default;
  };
  explicit Gate(std::filesystem::path path) : path_(std::move(path)) {}
  [[nodiscard]] Stamp stamp() const;

  std::filesystem::path path_;
  Stamp read_at_;
  std::vector<AllowedKey> keys_;
};

}  // namespace rig::protocol
