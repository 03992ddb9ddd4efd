// One thread for the devices that share a wire. It does short transactions one after the other: start, poll,
// read.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "core/base/clock.h"
#include "daemon/timings.h"

namespace rig::daemon {

class BusWorker {
 public:
  using Transaction = std::function<void()>;
  /// What a later transaction may make pointless: the motion of one axis, say. 0 is no group.
  using Group = int;

  explicit BusWorker(base::Clock& clock);
  /// Carries out what is queued, then ends.
  ~BusWorker();
  BusWorker(const BusWorker&) = delete;
  BusWorker& operator=(const BusWorker&) = delete;

  void queue(Transaction transaction, Group group = 0);
  /// Ahead of all that is queued: waits at most for the transaction in flight. What is queued of its group is
  /// dropped: a move that was waiting for its turn must not follow the stop.
  void queue_first(Transaction transaction, Group group = 0);

  /// How many transactions wait, and how long those that were carried out took.
  [[nodiscard]] std::size_t waiting() const { return mailbox_.size(); }
  [[nodiscard]] Timings& timings() { return timings_; }

 private:
  [[nodiscard]] std::uint64_t dropped_before(Group group);

  Timings timings_;
  std::mutex mutex_;
  std::map<Group, std::uint64_t> drops_;  // how often each group was dropped
  base::Mailbox<Transaction> mailbox_;    // an empty transaction ends the thread
  std::thread thread_;
};

}  // namespace rig::daemon
