#include "sim/state_file.h"

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <type_traits>
#include <unistd.h>

#include "core/base/random.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

static_assert(std::is_trivially_copyable_v<Memory>);
// No padding: all bytes count in the checksum.
static_assert(sizeof(AxisMemory) == 9 * 8 + 6 * 4 && sizeof(Memory) == 8 + kAxes * sizeof(AxisMemory) + 40);

struct Slot {
  std::uint64_t sequence;
  std::uint64_t checksum;  // 0: never written, or being written
  Memory memory;
};

constexpr std::size_t kBytes = 2 * sizeof(Slot);
// A file of another layout is not misread: this is part of the checksum.
constexpr std::uint64_t kLayout = 3;

std::uint64_t checksum(const Slot& slot) {
  std::uint64_t sum = base::derive_key(kLayout, slot.sequence);
  std::array<std::uint64_t, sizeof(Memory) / 8> words{};
  static_assert(sizeof(Memory) % 8 == 0);
  std::memcpy(words.data(), &slot.memory, sizeof(Memory));
  for (const std::uint64_t word : words) sum = base::derive_key(sum, word);
  return sum == 0 ? 1 : sum;
}

tl::unexpected<base::Error> failure(const char* doing, const std::filesystem::path& path) {
  return fail(ErrorCode::io,
              fmt::format("cannot {} the state of the virtual rig: {}", doing, std::strerror(errno)),
              path.string());
}

}  // namespace

struct StateFile::Mapping {
  std::filesystem::path path;
  Slot* slots = nullptr;
  Mapping() = default;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (slots != nullptr) ::munmap(slots, kBytes);
  }
  [[nodiscard]] bool valid(int i) const {
    return slots[i].checksum != 0 && slots[i].checksum == checksum(slots[i]);
  }
  // The slot that counts, or -1.
  [[nodiscard]] int newest() const {
    if (valid(0) && valid(1)) return slots[0].sequence > slots[1].sequence ? 0 : 1;
    return valid(0) ? 0 : valid(1) ? 1 : -1;
  }
  // Nothing was ever stored whole: also after a death in the very first store.
  [[nodiscard]] bool untouched() const { return slots[0].checksum == 0 && slots[1].checksum == 0; }
};

StateFile::StateFile(std::unique_ptr<Mapping> mapping) : mapping_(std::move(mapping)) {}
StateFile::StateFile(StateFile&&) noexcept = default;
StateFile& StateFile::operator=(StateFile&&) noexcept = default;
StateFile::~StateFile() = default;

Result<StateFile> StateFile::open(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) return failure("open", path);
  auto mapping = std::make_unique<Mapping>();
  mapping->path = path;
  // Blocks are reserved now, so that a full disk is an error here and not a signal at a later write.
  const int reserved = ::posix_fallocate(fd, 0, kBytes);
  const bool sized = reserved == 0 && ::ftruncate(fd, kBytes) == 0;
  if (reserved != 0) errno = reserved;
  void* memory = sized ? ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
  const int error = errno;
  ::close(fd);
  errno = error;
  if (memory == MAP_FAILED) return failure("map", path);
  mapping->slots = static_cast<Slot*>(memory);
  if (mapping->newest() < 0 && !mapping->untouched()) {
    return fail(ErrorCode::damaged, "the state of the virtual rig is damaged", path.string(),
                "remove the file to begin with a new virtual rig");
  }
  return StateFile(std::move(mapping));
}

Memory StateFile::load() const {
  const int slot = mapping_->newest();
  return slot < 0 ? Memory{} : mapping_->slots[slot].memory;
}

void StateFile::store(const Memory& memory) {
  const int current = mapping_->newest();
  const int next = current == 0 ? 1 : 0;
  Slot& slot = mapping_->slots[next];
  // Invalid until the checksum is there, so that a death in between leaves the other slot in force.
  slot.checksum = 0;
  std::atomic_signal_fence(std::memory_order_seq_cst);
  slot.sequence = current < 0 ? 1 : mapping_->slots[current].sequence + 1;
  slot.memory = memory;
  std::atomic_signal_fence(std::memory_order_seq_cst);
  slot.checksum = checksum(slot);
}

Result<void> StateFile::flush() {
  if (::msync(mapping_->slots, kBytes, MS_SYNC) != 0) return failure("flush", mapping_->path);
  return {};
}

}  // namespace rig::sim
