// INDI, the protocol of amateur observatories, as a peer: its server with one simulated device, as Debian
// ships them, and a client that speaks its XML over TCP.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <sys/types.h>
#include <utility>
#include <vector>

#include "core/base/result.h"

namespace rig::bench {

class IndiPeer {
 public:
  /// Starts `indiserver DRIVER`, its files below `folder`, and connects. ErrorCode::device where it is not
  /// installed; the hint says how to get it.
  [[nodiscard]] static base::Result<IndiPeer> start(const std::string& driver,
                                                    const std::filesystem::path& folder);
  IndiPeer(IndiPeer&& other) noexcept
      : pid_(std::exchange(other.pid_, -1)),
        socket_(std::exchange(other.socket_, -1)),
        bytes_(std::move(other.bytes_)),
        filled_(other.filled_),
        taken_(other.taken_) {}
  IndiPeer& operator=(IndiPeer&&) = delete;
  ~IndiPeer();

  [[nodiscard]] base::Result<void> send(std::string_view xml) const;

  /// What comes up to and with the next `end`; valid until the next call.
  [[nodiscard]] base::Result<std::string_view> read_to(std::string_view end, std::chrono::seconds patience);

 private:
  IndiPeer(pid_t pid, int socket);
  pid_t pid_;
  int socket_;
  std::vector<char> bytes_;
  std::size_t filled_ = 0;  // of bytes_
  std::size_t taken_ = 0;   // of them, given out by read_to
};

}  // namespace rig::bench
