// A connection that comes back: a device that was unplugged and plugged in again keeps its clients.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "core/base/clock.h"
#include "core/base/result.h"

namespace rig::drivers {

/// Holds a T, made by `open`. Whatever says `lost` closes it, and the next use opens it again; while that
/// fails it is tried once in `every`, and uses in between are answered `lost` at once with what the last try
/// said.
template <typename T>
class Connection {
 public:
  using Open = std::function<base::Result<std::unique_ptr<T>>()>;

  Connection(Open open, base::Clock& clock, base::Duration every = base::seconds(1))
      : open_(std::move(open)), clock_(clock), every_(every) {}

  /// Opens it where it is not open. Every failure of `open` is `lost`: what is not there now may come.
  [[nodiscard]] base::Result<T*> get() {
    if (held_) return held_.get();
    const base::Time now = clock_.now();
    if (failed_ && now < try_at_) return tl::unexpected<base::Error>(*failed_);
    auto opened = open_();
    if (!opened) {
      failed_ = opened.error();
      failed_->code = base::ErrorCode::lost;
      try_at_ = now + every_;
      return tl::unexpected<base::Error>(*failed_);
    }
    failed_.reset();
    held_ = std::move(*opened);
    ++times_opened_;
    return held_.get();
  }

  /// `use` with the T; closes it where the answer is `lost`.
  template <typename Use>
  [[nodiscard]] auto use(Use&& use) -> decltype(use(std::declval<T&>())) {
    auto held = get();
    if (!held) return tl::unexpected<base::Error>(held.error());
    auto answer = use(**held);
    if (!answer && answer.error().code == base::ErrorCode::lost) close();
    return answer;
  }

  void close() { held_.reset(); }
  [[nodiscard]] bool is_open() const { return held_ != nullptr; }
  /// 1 after the first; what a driver knew of the device is void when it grows.
  [[nodiscard]] int times_opened() const { return times_opened_; }

 private:
  const Open open_;
  base::Clock& clock_;
  const base::Duration every_;
  std::unique_ptr<T> held_;
  std::optional<base::Error> failed_;
  base::Time try_at_{};
  int times_opened_ = 0;
};

}  // namespace rig::drivers
