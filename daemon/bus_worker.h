// One thread for the devices that share a wire. It does short transactions one after the other: start, poll,
// read.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "core/base/clock.h"
#include "daemon/timings.h"

namespace rig::daemon {

/// What a transaction is called, and how long its calls may take.
struct Deadline {
  std::string what;  ///< "axis pan: a reading"
  base::Duration bound = base::Duration::max();
};

class BusWorker {
 public:
  using Transaction = std::function<void()>;
  /// What a later transaction may make pointless: the motion of one axis, say. 0 is no group.
  using Group = int;

  /// `name` is what its thread is called (base::name_thread).
  BusWorker(base::Clock& clock, std::string name);
  /// Carries out what is queued, then ends.
  ~BusWorker();
  BusWorker(const BusWorker&) = delete;
  BusWorker& operator=(const BusWorker&) = delete;

  void queue(Transaction transaction, Group group = 0, Deadline deadline = {});
  /// Ahead of all that is queued: waits at most for the transaction in flight. What is queued of its group is
  /// dropped: a move that was waiting for its turn must not follow the stop.
  void queue_first(Transaction transaction, Group group = 0, Deadline deadline = {});

  /// From any thread: what took longer than it may, in words; each such transaction is told of once, while it
  /// is still in flight or after it has returned.
  [[nodiscard]] std::optional<std::string> overdue();

  /// How many transactions wait, and how long those that were carried out took.
  [[nodiscard]] std::size_t waiting() const { return mailbox_.size(); }
  [[nodiscard]] Timings& timings() { return timings_; }

 private:
  struct InFlight {
    Deadline deadline;
    base::Time began{};
    bool told = false;
  };

  [[nodiscard]] std::uint64_t dropped_before(Group group);
  void carry_out(const Transaction& transaction, const Deadline& deadline);
  /// With the lock held.
  void note_if_late();

  base::Clock& clock_;
  Timings timings_;
  std::mutex mutex_;
  std::optional<InFlight> in_flight_;
  std::deque<std::string> late_;
  std::map<Group, std::uint64_t> drops_;  // how often each group was dropped
  base::Mailbox<Transaction> mailbox_;    // an empty transaction ends the thread
  std::thread thread_;
};

}  // namespace rig::daemon
