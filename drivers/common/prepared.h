// A connection to a device that has to be set up before it can be used, some of it at each call.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include "drivers/common/connection.h"
#include "drivers/common/retry.h"

namespace rig::drivers {

/// T has `Result<bool> set_up()`, which does a call's share of it (true: all is done; an error: it begins
/// anew on a new connection), `bool is_set_up() const`, and `void begin_call(Deadline)`, which is told before
/// each call when that has to be over.
template <typename T>
class Prepared {
 public:
  using Open = typename Connection<T>::Open;

  /// `name` of the device, for messages ("/dev/ttyUSB0: the pan-tilt unit"). `back` is told whenever it is
  /// set up again.
  Prepared(Open open, base::Clock& clock, const RetryPolicy& policy, std::string name,
           std::function<void()> back)
      : connection_(std::move(open), clock),
        policy_(policy),
        name_(std::move(name)),
        back_(std::move(back)) {}

  /// Waits until it is set up. What is lost although its line is there may be busy with itself: it is waited
  /// for as long as `patience`.
  [[nodiscard]] base::Result<T*> wait(std::chrono::milliseconds patience) {
    const auto enough = std::chrono::steady_clock::now() + patience;
    while (true) {
      const bool was_open = connection_.is_open();
      const int before = connection_.times_opened();
      const auto done = set_up(policy_.call_ends());
      if (done && *done) return connection_.get();
      const bool has_line = was_open || connection_.times_opened() > before;
      const bool silent = !done && done.error().code == base::ErrorCode::lost && has_line;
      if (!done && (!silent || std::chrono::steady_clock::now() >= enough)) return base::pass(done);
      std::this_thread::sleep_for(std::chrono::milliseconds(done ? 1 : 50));
    }
  }

  /// `use` with the T; until that is set up it is lost.
  template <typename Use>
  [[nodiscard]] auto use(Use&& use) -> decltype(use(std::declval<T&>())) {
    const Deadline ends = policy_.call_ends();
    const auto ready = set_up(ends);
    if (!ready) return base::pass(ready);
    // Time that setting up has used is not there for what was asked.
    if (!*ready || ends < std::chrono::steady_clock::now() + policy_.answer) return still_setting_up();
    return connection_.use(std::forward<Use>(use));
  }

  /// For stops: `use` where it is set up, else `shout`, and it is lost all the same.
  template <typename Use, typename Shout>
  [[nodiscard]] base::Result<void> use_at_once(Use&& use, Shout&& shout) {
    const Deadline ends = policy_.call_ends();
    const auto held = connection_.get();
    if (!held) return base::pass(held);
    (*held)->begin_call(ends);
    if ((*held)->is_set_up()) return connection_.use(std::forward<Use>(use));
    if (auto ok = shout(**held); !ok) {
      connection_.close();
      return ok;
    }
    return still_setting_up();
  }

 private:
  [[nodiscard]] base::Result<bool> set_up(Deadline call_ends) {
    auto held = connection_.get();
    if (!held) return base::pass(held);
    (*held)->begin_call(call_ends);
    if ((*held)->is_set_up()) return true;
    auto done = (*held)->set_up();
    if (!done) {
      connection_.close();
    } else if (*done && std::exchange(was_set_up_, true)) {
      back_();
    }
    return done;
  }
  [[nodiscard]] tl::unexpected<base::Error> still_setting_up() const {
    return base::fail(base::ErrorCode::lost, "it is being set up", name_);
  }

  Connection<T> connection_;
  const RetryPolicy policy_;
  const std::string name_;
  const std::function<void()> back_;
  bool was_set_up_ = false;
};

}  // namespace rig::drivers
