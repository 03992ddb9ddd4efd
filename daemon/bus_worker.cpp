#include "daemon/bus_worker.h"

#include <fmt/format.h>

#include "core/base/thread.h"

namespace rig::daemon {

BusWorker::BusWorker(base::Clock& clock, std::string name) : clock_(clock), mailbox_(clock) {
  thread_ = std::thread([this, name = std::move(name), member = base::ClockMember(clock)] {
    base::name_thread(name.c_str());
    while (true) {
      const auto transaction = mailbox_.pop();
      if (!transaction) continue;
      if (!*transaction) return;
      const Timings::Measure measure(timings_);
      (*transaction)();
    }
  });
}

BusWorker::~BusWorker() {
  mailbox_.push({});
  thread_.join();
}

std::uint64_t BusWorker::dropped_before(Group group) {
  const std::lock_guard lock(mutex_);
  return drops_[group];
}

void BusWorker::note_if_late() {
  if (!in_flight_ || in_flight_->told) return;
  const Deadline& deadline = in_flight_->deadline;
  if (clock_.now() - in_flight_->began <= deadline.bound) return;
  in_flight_->told = true;
  late_.push_back(fmt::format("{} took longer than {:g} s", deadline.what, base::to_seconds(deadline.bound)));
}

std::optional<std::string> BusWorker::overdue() {
  const std::lock_guard lock(mutex_);
  note_if_late();
  if (late_.empty()) return std::nullopt;
  std::optional<std::string> late(std::move(late_.front()));
  late_.pop_front();
  return late;
}

void BusWorker::carry_out(const Transaction& transaction, const Deadline& deadline) {
  {
    const std::lock_guard lock(mutex_);
    in_flight_ = InFlight{deadline, clock_.now(), false};
  }
  transaction();
  const std::lock_guard lock(mutex_);
  note_if_late();
  in_flight_.reset();
}

void BusWorker::queue(Transaction transaction, Group group, Deadline deadline) {
  const std::uint64_t drops = group == 0 ? 0 : dropped_before(group);
  mailbox_.push([this, group, drops, transaction = std::move(transaction), deadline = std::move(deadline)] {
    if (group == 0 || dropped_before(group) == drops) carry_out(transaction, deadline);
  });
}

void BusWorker::queue_first(Transaction transaction, Group group, Deadline deadline) {
  if (group != 0) {
    const std::lock_guard lock(mutex_);
    ++drops_[group];
  }
  mailbox_.push_front([this, transaction = std::move(transaction), deadline = std::move(deadline)] {
    carry_out(transaction, deadline);
  });
}

}  // namespace rig::daemon
