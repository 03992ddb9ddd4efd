#include "drivers/conformance/process_use.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <malloc.h>
#include <unistd.h>

namespace rig::drivers::conformance {

namespace fs = std::filesystem;

namespace {

std::size_t entries_of(const fs::path& folder) {
  std::error_code gone_meanwhile;
  std::size_t count = 0;
  for (fs::directory_iterator it(folder, gone_meanwhile), end; it != end; it.increment(gone_meanwhile))
    ++count;
  return count;
}

}  // namespace

ProcessUse process_use() {
  ProcessUse use;
  use.descriptors = entries_of("/proc/self/fd");
  use.threads = entries_of("/proc/self/task");
  const struct mallinfo2 heap = ::mallinfo2();
  use.heap_bytes = heap.uordblks + heap.hblkhd;
  std::size_t all_pages = 0;
  std::size_t resident_pages = 0;
  std::ifstream("/proc/self/statm") >> all_pages >> resident_pages;
  use.resident_bytes = resident_pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return use;
}

}  // namespace rig::drivers::conformance
