// What a disk may hold after the power went at a moment of a recorded sequence: what was flushed, and of the
// rest all, nothing or some.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "tests/core/disk/operation_log.h"

namespace rig::test {

/// What became of the writes and folder entries that were not flushed.
enum class Unflushed {
  dropped,
  kept,           ///< as when only the program dies
  torn,           ///< kept, of the last write the first half
  only_entries,   ///< files are there, what was written into them is not
  only_contents,  ///< what was written is there, names are as they were
  some,           ///< each write by chance there, torn or not; of each folder's changes the first few
};

class DiskImage {
 public:
  /// What lies below `root` now, all of it flushed. With root's own name as the folder.
  explicit DiskImage(const std::filesystem::path& root);

  /// Operations as OperationLog has them, in their order.
  void apply(const Operation& operation);

  /// Makes `folder` (which must not exist) hold what the disk may hold now.
  void restore(const std::filesystem::path& folder, Unflushed unflushed, base::Random& random) const;

 private:
  struct Write {
    std::uint64_t offset = 0;
    std::string bytes;
    bool truncates = false;
  };
  // Names and the nodes they lead to from now on, -1: none. What belongs together happens together.
  using Change = std::map<std::string, int>;
  struct Node {
    bool folder = false;
    std::string flushed;
    std::vector<Write> writes;           // since the last flush
    std::map<std::string, int> entries;  // as programs see them
    std::map<std::string, int> flushed_entries;
    std::vector<Change> changes;  // since the last flush
  };

  int load(const std::filesystem::path& path);
  [[nodiscard]] int find(const std::filesystem::path& path) const;
  void change(const std::vector<std::pair<std::filesystem::path, int>>& entries);
  void restore_node(int node, const std::filesystem::path& path, Unflushed unflushed,
                    base::Random& random) const;
  static void change(std::map<std::string, int>& entries, const Change& change);
  static void write(std::string& content, const Write& write, std::size_t most);

  std::vector<Node> nodes_;
  std::map<int, int> open_;  // number of an open file -> node
  int last_written_ = -1;    // the node of the last operation, if that was a write
};

}  // namespace rig::test
