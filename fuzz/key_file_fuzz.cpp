// Whatever a file of keys holds: it is read, or refused in words.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/keys.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = ::memfd_create("keys", MFD_CLOEXEC);
  if (file < 0 || ::fchmod(file, 0600) != 0) std::abort();
  if (::write(file, data, size) != static_cast<ssize_t>(size)) std::abort();
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  const auto pair = rig::protocol::read_key_file(path);
  if (!pair && pair.error().what.empty()) std::abort();
  const auto key = rig::protocol::read_public_key(path);
  if (!key && key.error().what.empty()) std::abort();
  ::close(file);
  return 0;
}
