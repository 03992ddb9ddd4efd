// What was done to the files below one folder, in order: by the project's own file layer and by SQLite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace rig::test {

struct Operation {
  enum class Kind {
    open,  ///< made if it was not there
    write,
    truncate,  ///< `offset` is the new size
    flush,
    make_folder,
    flush_folder,
    rename,
    exchange,
    remove,
    note,  ///< no operation: `path` says what was reached
  };
  Kind kind = Kind::note;
  std::string path{};  ///< relative to the folder; empty: the folder itself
  std::string to{};    ///< of a rename or an exchange
  int file = 0;        ///< number of the open file that is written, truncated or flushed
  std::uint64_t offset = 0;
  std::string bytes{};

  [[nodiscard]] std::string text() const;
};

class OperationLog {
 public:
  explicit OperationLog(const std::filesystem::path& root) : root_(root) {}

  /// Called before an operation: an errno it fails with, or 0. A write that fails is partly there.
  std::function<int(const Operation&)> refuse;

  [[nodiscard]] bool concerns(const std::filesystem::path& path) const;
  [[nodiscard]] std::string relative(const std::filesystem::path& path) const;
  [[nodiscard]] int new_file();
  /// Whether the operation is to be done: 0, or an errno.
  [[nodiscard]] int refused(const Operation& operation) const { return refuse ? refuse(operation) : 0; }
  void add(Operation operation);
  void note(const std::string& what) { add({Operation::Kind::note, what}); }

  [[nodiscard]] const std::vector<Operation>& operations() const { return operations_; }

 private:
  std::filesystem::path root_;
  std::mutex mutex_;
  int last_file_ = 0;
  std::vector<Operation> operations_;
};

}  // namespace rig::test
