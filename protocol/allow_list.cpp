#include "protocol/allow_list.h"

#include <algorithm>
#include <set>

#include "core/base/config.h"
#include "core/base/files.h"
#include "protocol/keys.h"

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr std::int64_t kFormat = 1;
constexpr std::size_t kLongestName = 64;

bool may_be_in_a_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
         c == '@' || c == '-';
}

Result<std::vector<AllowedKey>> read_list(const base::ConfigTable& root) {
  if (const auto format = root.integer("format", 1, 1'000'000); format > kFormat) {
    return fail(ErrorCode::newer,
                fmt::format("format {} is newer than this program reads ({})", format, kFormat),
                root.where("format"), "use a newer rigd");
  }
  std::vector<AllowedKey> keys;
  std::set<std::string> names;
  std::set<std::string> seen;
  for (const base::ConfigTable& entry : root.tables("key")) {
    AllowedKey key;
    key.name = entry.text("name");
    key.public_key = entry.text("public_key");
    key.role = role_named(entry.choice("role", role_names())).value_or(Role::observer);
    if (!is_client_name(key.name)) entry.error("name", "has 1 to 64 letters, digits and ._@-");
    if (!is_key(key.public_key)) entry.error("public_key", "is no key: 40 letters of Z85");
    if (!names.insert(key.name).second) entry.error("name", "is there twice");
    if (!seen.insert(key.public_key).second) entry.error("public_key", "is there twice");
    keys.push_back(std::move(key));
  }
  if (auto ok = root.finish(); !ok) return pass(ok);
  return keys;
}

}  // namespace

bool is_client_name(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName &&
         std::all_of(name.begin(), name.end(), may_be_in_a_name);
}

Result<std::vector<AllowedKey>> parse_allow_list(std::string_view text, const std::string& name) {
  const auto root = base::ConfigTable::parse(text, name);
  if (!root) return pass(root);
  return read_list(*root);
}

Result<std::vector<AllowedKey>> read_allow_list(const fs::path& path) {
  const auto text = base::read_file(path);
  if (!text) {
    return fail(text.error().code, text.error().what, path.string(), "`rig keys allow` writes this list");
  }
  return parse_allow_list(*text, path.string());
}

Result<void> write_allow_list(const fs::path& path, const std::vector<AllowedKey>& keys) {
  std::string text = fmt::format(
      "# Who may connect to rigd over the network. `rig keys allow` and `rig keys revoke` write this file;\n"
      "# rigd reads it again when it changes.\nformat = {}\n",
      kFormat);
  for (const AllowedKey& key : keys) {
    text += fmt::format("\n[[key]]\nname = \"{}\"\npublic_key = \"{}\"\nrole = \"{}\"\n", key.name,
                        key.public_key, role_name(key.role));
  }
  return base::write_file_durably(path, text);
}

Result<void> allow_key(const fs::path& path, const AllowedKey& key) {
  if (!is_client_name(key.name)) {
    return fail(ErrorCode::bad_input, "a client's name has 1 to 64 letters, digits and ._@-", key.name);
  }
  if (!is_key(key.public_key)) return fail(ErrorCode::bad_input, "is no public key", key.public_key);
  std::vector<AllowedKey> keys;
  std::error_code error;
  if (fs::exists(path, error)) {
    auto there = read_allow_list(path);
    if (!there) return pass(there);
    keys = std::move(*there);
  }
  for (const AllowedKey& other : keys) {
    if (other.name == key.name) {
      return fail(ErrorCode::refused, fmt::format("a client '{}' is allowed already", key.name),
                  path.string(), "revoke it first, or choose another name");
    }
    if (other.public_key == key.public_key) {
      return fail(ErrorCode::refused, fmt::format("this key is allowed already, as '{}'", other.name),
                  path.string());
    }
  }
  keys.push_back(key);
  return write_allow_list(path, keys);
}

Result<AllowedKey> revoke_key(const fs::path& path, const std::string& name_or_key) {
  auto keys = read_allow_list(path);
  if (!keys) return pass(keys);
  const auto found = std::find_if(keys->begin(), keys->end(), [&](const AllowedKey& key) {
    return key.name == name_or_key || key.public_key == name_or_key;
  });
  if (found == keys->end()) {
    return fail(ErrorCode::not_found, fmt::format("there is no client '{}' to revoke", name_or_key),
                path.string(), "`rig keys list` shows them");
  }
  AllowedKey gone = *found;
  keys->erase(found);
  if (auto ok = write_allow_list(path, *keys); !ok) return pass(ok);
  return gone;
}

}  // namespace rig::protocol
