// A serial line and the reader that cuts what comes over it into replies.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "drivers/common/serial_line.h"

namespace rig::drivers {

/// `Reader` has `void feed(std::string_view)` and `std::optional<Reply> next()`, and is a pure function of
/// the bytes that it was fed.
template <typename Reader>
class ReplyStream {
 public:
  using Reply = typename decltype(std::declval<Reader&>().next())::value_type;
  using Time = std::chrono::steady_clock::time_point;

  explicit ReplyStream(std::unique_ptr<SerialLine> line) : line_(std::move(line)) {}

  [[nodiscard]] base::Result<void> write(std::string_view bytes, std::chrono::milliseconds within) {
    return line_->write(bytes, within);
  }

  /// The next reply; nothing where none is complete by `deadline`. A deadline that has passed takes what is
  /// there.
  [[nodiscard]] base::Result<std::optional<Reply>> next(Time deadline) {
    // A line that never falls silent and never says anything is not listened to for ever.
    constexpr std::size_t kMostAfterDeadline = 65536;
    std::size_t late = 0;
    while (late < kMostAfterDeadline) {
      if (auto reply = reader_.next()) return reply;
      auto bytes = line_->read_some(deadline);
      if (!bytes) return base::pass(bytes);
      if (bytes->empty()) break;
      reader_.feed(*bytes);
      if (std::chrono::steady_clock::now() >= deadline) late += bytes->size();
    }
    return std::optional<Reply>();
  }

  [[nodiscard]] const std::string& path() const { return line_->path(); }

 private:
  std::unique_ptr<SerialLine> line_;
  Reader reader_;
};

}  // namespace rig::drivers
