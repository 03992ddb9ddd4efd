#include "protocol/keys.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include "core/base/config.h"
#include "core/base/files.h"

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr std::size_t kKeyLetters = 40;
constexpr std::int64_t kFormat = 1;
using Letters = std::array<char, kKeyLetters + 1>;

Result<void> write_new_file(const fs::path& path, const std::string& text, mode_t mode) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
  if (fd < 0) {
    const bool exists = errno == EEXIST;
    return fail(exists ? ErrorCode::refused : ErrorCode::io,
                exists ? "exists already; a key is never overwritten"
                       : fmt::format("cannot make the file: {}", std::strerror(errno)),
                path.string(), exists ? "choose another name, or remove it" : "");
  }
  const bool written =
      ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(fd) == 0;
  const int error = errno;
  ::close(fd);
  if (written) return {};
  std::error_code already_gone;
  fs::remove(path, already_gone);
  return fail(ErrorCode::io, fmt::format("cannot write the key: {}", std::strerror(error)), path.string());
}

Result<void> check_private(const fs::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    return fail(errno == ENOENT ? ErrorCode::not_found : ErrorCode::io,
                fmt::format("cannot read the key: {}", std::strerror(errno)), path.string(),
                errno == ENOENT ? "`rig keys make` makes one" : "");
  }
  if ((info.st_mode & 077U) != 0) {
    return fail(ErrorCode::refused, "the secret key may be read by others than its owner", path.string(),
                fmt::format("chmod 600 {}", path.string()));
  }
  return {};
}

Result<void> check_format(const base::ConfigTable& root) {
  if (const auto format = root.integer("format", 1, 1'000'000); format > kFormat) {
    return fail(ErrorCode::newer,
                fmt::format("format {} is newer than this program reads ({})", format, kFormat),
                root.where("format"));
  }
  return {};
}

std::string read_key(const base::ConfigTable& root, const char* name) {
  std::string key = root.text(name);
  if (!is_key(key)) root.error(name, "is no key: 40 letters of Z85");
  return key;
}

}  // namespace

Result<KeyPair> make_key_pair() {
  Letters public_key{};
  Letters secret_key{};
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0) {
    return fail(ErrorCode::io, "cannot make a key: this ZeroMQ was built without CURVE");
  }
  return KeyPair{public_key.data(), secret_key.data()};
}

bool is_key(std::string_view text) {
  if (text.size() != kKeyLetters) return false;
  std::array<std::uint8_t, 32> bytes{};
  return zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

Result<void> write_key_files(const fs::path& path, const KeyPair& keys) {
  fs::path public_path = path;
  public_path += ".pub";
  const auto with_format = [](const std::string& comment, const std::string& rest) {
    return fmt::format("# {}\nformat = {}\n{}", comment, kFormat, rest);
  };
  const std::string public_line = fmt::format("public_key = \"{}\"\n", keys.public_key);
  if (auto ok = write_new_file(
          public_path, with_format("A public key of rigd; need not be kept secret.", public_line), 0644);
      !ok) {
    return ok;
  }
  auto ok =
      write_new_file(path,
                     with_format("A secret key of rigd: whoever can read this file is who it stands for.",
                                 public_line + fmt::format("secret_key = \"{}\"\n", keys.secret_key)),
                     0600);
  if (!ok) {
    std::error_code already_gone;
    fs::remove(public_path, already_gone);
    return ok;
  }
  return base::flush_folder(fs::absolute(path).parent_path());
}

Result<KeyPair> read_key_file(const fs::path& path) {
  if (auto ok = check_private(path); !ok) return pass(ok);
  const auto root = base::ConfigTable::parse_file(path.string());
  if (!root) return pass(root);
  if (auto ok = check_format(*root); !ok) return pass(ok);
  const KeyPair keys{read_key(*root, "public_key"), read_key(*root, "secret_key")};
  if (auto ok = root->finish(); !ok) return pass(ok);
  Letters belongs{};
  if (zmq_curve_public(belongs.data(), keys.secret_key.c_str()) != 0 || keys.public_key != belongs.data()) {
    return fail(ErrorCode::damaged, "the public key does not belong to the secret one", path.string(),
                "make a new pair");
  }
  return keys;
}

Result<std::string> read_public_key(const std::string& key_or_file) {
  if (is_key(key_or_file)) return key_or_file;
  std::error_code error;
  if (!fs::exists(key_or_file, error)) {
    return fail(ErrorCode::not_found, "is neither a public key (40 letters) nor a file that has one",
                key_or_file);
  }
  const auto root = base::ConfigTable::parse_file(key_or_file);
  if (!root) return pass(root);
  if (auto ok = check_format(*root); !ok) return pass(ok);
  if (root->has("secret_key")) {
    return fail(ErrorCode::refused, "holds a secret key, which stays where it is", key_or_file,
                "name the .pub file beside it");
  }
  std::string key = read_key(*root, "public_key");
  if (auto ok = root->finish(); !ok) return pass(ok);
  return key;
}

}  // namespace rig::protocol
