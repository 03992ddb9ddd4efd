// One thread for the devices that share a wire. It does short transactions one after the other: start, poll,
// read.
#pragma once

#include <functional>
#include <thread>

#include "core/base/clock.h"

namespace rig::daemon {

class BusWorker {
 public:
  using Transaction = std::function<void()>;

  explicit BusWorker(base::Clock& clock);
  /// Carries out what is queued, then ends.
  ~BusWorker();
  BusWorker(const BusWorker&) = delete;
  BusWorker& operator=(const BusWorker&) = delete;

  void queue(Transaction transaction);
  /// Ahead of all that is queued: waits at most for the transaction in flight.
  void queue_first(Transaction transaction);

 private:
  base::Mailbox<Transaction> mailbox_;  // an empty transaction ends the thread
  std::thread thread_;
};

}  // namespace rig::daemon
