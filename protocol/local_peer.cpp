#include "protocol/local_peer.h"

#include <array>
#include <charconv>
#include <fmt/format.h>
#include <pwd.h>

namespace rig::protocol {

std::optional<uid_t> peer_uid(std::string_view peer_address) {
  // The last three parts; the host before them is of no interest and may hold colons.
  std::array<std::string_view, 3> parts;
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    const auto colon = peer_address.rfind(':');
    if (colon == std::string_view::npos) return std::nullopt;
    *part = peer_address.substr(colon + 1);
    peer_address = peer_address.substr(0, colon);
  }
  std::array<uid_t, 3> numbers{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const char* end = parts[i].data() + parts[i].size();
    const auto [stop, error] = std::from_chars(parts[i].data(), end, numbers[i]);
    if (error != std::errc() || stop != end) return std::nullopt;
  }
  return numbers[0];
}

const std::string& LocalNames::of(uid_t uid) {
  const auto known = names_.find(uid);
  if (known != names_.end()) return known->second;
  std::array<char, 16384> room{};
  passwd entry{};
  passwd* found = nullptr;
  std::string name = fmt::format("local/uid-{}", uid);
  if (::getpwuid_r(uid, &entry, room.data(), room.size(), &found) == 0 && found != nullptr) {
    name = fmt::format("local/{}", entry.pw_name);
  }
  return names_.emplace(uid, std::move(name)).first->second;
}

}  // namespace rig::protocol
