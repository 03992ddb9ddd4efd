// The commands of a Tic over its transport, each repeated where its answer is late or garbled. The worker and
// the feeder both use it.
#pragma once

#include <atomic>
#include <memory>

#include "drivers/common/retry.h"
#include "drivers/tic_axis/fair_lock.h"
#include "drivers/tic_axis/protocol.h"
#include "drivers/tic_axis/transport.h"

namespace rig::drivers::tic {

/// Any thread; one transfer at a time. All that it sends may be sent twice without harm.
class Link {
 public:
  Link(std::unique_ptr<Transport> transport, const RetryPolicy& policy)
      : transport_(std::move(transport)), policy_(policy) {}

  /// What the worker asks for from now on belongs to a call that has to be over by then. Of a stop commands
  /// are sent at least once, also when its time is over. The feeder's and quick_once() keep their own time.
  void begin_call(Deadline ends, bool stop = false) {
    call_ends_ = ends;
    stop_ = stop;
  }
  [[nodiscard]] Deadline call_ends() const { return call_ends_; }

  [[nodiscard]] base::Result<void> quick(Command command);
  /// Sent once, and given up if it is not answered within 50 ms.
  [[nodiscard]] base::Result<void> quick_once(Command command);
  /// With 7 bits.
  [[nodiscard]] base::Result<void> write7(Command command, std::uint8_t value);
  [[nodiscard]] base::Result<void> write32(Command command, std::int64_t value);
  [[nodiscard]] base::Result<void> set_setting(std::uint16_t offset, std::uint8_t value);
  [[nodiscard]] base::Result<Variables> variables();
  [[nodiscard]] base::Result<Settings> settings();
  /// The errors that have occurred since this was last called, by anybody.
  [[nodiscard]] base::Result<std::uint32_t> take_errors_occurred();
  /// Resets the command timeout, as quick_once: no stop waits behind it for long.
  [[nodiscard]] base::Result<void> feed();

  /// The transport is no more. A Tic that only does not answer is `lost` to who asks, and not gone: what is
  /// sent to it may arrive.
  [[nodiscard]] bool gone() const { return gone_; }

  [[nodiscard]] const Identity& identity() const { return transport_->identity(); }

 private:
  [[nodiscard]] base::Result<void> out(Command command, std::uint16_t value, std::uint16_t index);
  [[nodiscard]] base::Result<void> out(Command command, std::uint16_t value, std::uint16_t index,
                                       const RetryPolicy& policy, Deadline ends);
  /// Hands on what the transport answers; notes where that is that it is no more.
  template <typename T>
  [[nodiscard]] base::Result<T> noting(base::Result<T> answer) {
    if (!answer && answer.error().code == base::ErrorCode::lost) gone_ = true;
    return answer;
  }
  /// Exactly so many bytes.
  [[nodiscard]] base::Result<std::vector<std::uint8_t>> in(Command command, std::uint16_t offset,
                                                           std::uint16_t length, Deadline answer_by);

  const std::unique_ptr<Transport> transport_;
  const RetryPolicy policy_;
  Deadline call_ends_ = Deadline::max();  // the worker's alone, like the next
  bool stop_ = false;
  FairLock turn_;
  std::atomic<bool> gone_{false};
};

}  // namespace rig::drivers::tic
