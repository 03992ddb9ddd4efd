#include "daemon/bus_worker.h"

namespace rig::daemon {

BusWorker::BusWorker(base::Clock& clock) : mailbox_(clock) {
  thread_ = std::thread([this, member = base::ClockMember(clock)] {
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

void BusWorker::queue(Transaction transaction, Group group) {
  if (group == 0) {
    mailbox_.push(std::move(transaction));
    return;
  }
  mailbox_.push([this, group, drops = dropped_before(group), transaction = std::move(transaction)] {
    if (dropped_before(group) == drops) transaction();
  });
}

void BusWorker::queue_first(Transaction transaction, Group group) {
  if (group != 0) {
    const std::lock_guard lock(mutex_);
    ++drops_[group];
  }
  mailbox_.push_front(std::move(transaction));
}

}  // namespace rig::daemon
