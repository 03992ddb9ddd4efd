#include "tests/core/disk/operation_log.h"

#include <array>
#include <fmt/format.h>

namespace rig::test {

std::string Operation::text() const {
  constexpr std::array kNames{"open",         "write",  "truncate", "flush",  "make folder",
                              "flush folder", "rename", "exchange", "remove", "note"};
  return fmt::format("{} {} {} (file {}, offset {}, {} bytes)", kNames.at(static_cast<std::size_t>(kind)),
                     path, to, file, offset, bytes.size());
}

bool OperationLog::concerns(const std::filesystem::path& path) const {
  const std::string inside = path.lexically_relative(root_).string();
  return !inside.empty() && inside.rfind("..", 0) != 0;
}

std::string OperationLog::relative(const std::filesystem::path& path) const {
  const std::string inside = path.lexically_normal().lexically_relative(root_).string();
  return inside == "." ? std::string() : inside;
}

int OperationLog::new_file() {
  const std::lock_guard lock(mutex_);
  return ++last_file_;
}

void OperationLog::add(Operation operation) {
  const std::lock_guard lock(mutex_);
  operations_.push_back(std::move(operation));
}

}  // namespace rig::test
