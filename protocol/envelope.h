// The two frames of every message: four bytes that name the protocol, and a Protocol Buffers message.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

inline constexpr std::string_view kMagic = "RIG1";
inline constexpr std::uint32_t kVersion = 1;

/// A request out of the frames behind the routing id. An Error says why it is none; `id` is set as soon as it
/// could be read, so that the sender can be answered.
[[nodiscard]] base::Result<Request> read_request(const std::vector<std::string_view>& frames,
                                                 std::uint64_t& id);

/// rigd's message out of its frames.
[[nodiscard]] base::Result<Message> read_message(const std::vector<std::string_view>& frames);

}  // namespace rig::protocol
