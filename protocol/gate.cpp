#include "protocol/gate.h"

#include <algorithm>
#include <array>
#include <sys/stat.h>
#include <zmq.h>

#include "core/base/log.h"

namespace rig::protocol {

using base::pass;
using base::Result;

namespace {

constexpr std::size_t kKeyBytes = 32;

// The frames of a request of ZAP, in their order.
enum ZapFrame : std::size_t { kVersion, kRequestId, kDomain, kAddress, kRouting, kMechanism, kCredentials };

std::string as_text(const std::string& key) {
  std::array<char, 41> text{};
  zmq_z85_encode(text.data(), reinterpret_cast<const std::uint8_t*>(key.data()), key.size());
  return text.data();
}

}  // namespace

Result<Gate> Gate::open(const std::filesystem::path& allow_list) {
  Gate gate(allow_list);
  gate.read_at_ = gate.stamp();
  auto keys = read_allow_list(allow_list);
  if (!keys) return pass(keys);
  gate.keys_ = std::move(*keys);
  return gate;
}

Gate::Stamp Gate::stamp() const {
  struct stat info {};
  if (::stat(path_.c_str(), &info) != 0) return {};
  return {info.st_mtim.tv_sec, info.st_mtim.tv_nsec, info.st_size, info.st_ino};
}

std::vector<AllowedKey> Gate::refresh() {
  const Stamp now = stamp();
  if (now == read_at_) return {};
  read_at_ = now;
  const std::vector<AllowedKey> before = std::move(keys_);
  keys_.clear();
  if (auto keys = read_allow_list(path_); keys) {
    keys_ = std::move(*keys);
    base::log_info("{}: read again, {} clients are allowed", path_.string(), keys_.size());
  } else {
    base::log_error("{}: nobody is allowed over the network until this is mended", keys.error().text());
  }
  std::vector<AllowedKey> gone;
  for (const AllowedKey& key : before) {
    if (find(key.public_key) == nullptr) gone.push_back(key);
  }
  return gone;
}

const AllowedKey* Gate::find(std::string_view public_key) const {
  const auto found = std::find_if(keys_.begin(), keys_.end(),
                                  [&](const AllowedKey& key) { return key.public_key == public_key; });
  return found == keys_.end() ? nullptr : &*found;
}

std::vector<std::string> Gate::answer(const std::vector<std::string>& request) const {
  const auto frame = [&](ZapFrame which) { return which < request.size() ? request[which] : std::string(); };
  const auto reply = [&](const char* code, const char* text, const std::string& user) {
    return std::vector<std::string>{"1.0", frame(kRequestId), code, text, user, ""};
  };
  if (request.size() != kCredentials + 1 || frame(kVersion) != "1.0" || frame(kDomain) != kZapDomain ||
      frame(kMechanism) != "CURVE" || frame(kCredentials).size() != kKeyBytes) {
    return reply("400", "a CURVE key is needed", "");
  }
  const std::string key = as_text(frame(kCredentials));
  const AllowedKey* client = find(key);
  if (client == nullptr) {
    base::log_warning("a client at {} with the key {} was turned away: it is not allowed", frame(kAddress),
                      key);
    return reply("400", "this key is not allowed", "");
  }
  base::log_info("'{}' connects from {} as {}", client->name, frame(kAddress), role_name(client->role));
  return reply("200", "OK", key);
}

}  // namespace rig::protocol
