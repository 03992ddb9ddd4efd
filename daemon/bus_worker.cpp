#include "daemon/bus_worker.h"

namespace rig::daemon {

BusWorker::BusWorker(base::Clock& clock) : mailbox_(clock) {
  thread_ = std::thread([this, member = base::ClockMember(clock)] {
    while (true) {
      const auto transaction = mailbox_.pop();
      if (!transaction) continue;
      if (!*transaction) return;
      (*transaction)();
    }
  });
}

BusWorker::~BusWorker() {
  mailbox_.push({});
  thread_.join();
}

void BusWorker::queue(Transaction transaction) {
  mailbox_.push(std::move(transaction));
}
void BusWorker::queue_first(Transaction transaction) {
  mailbox_.push_front(std::move(transaction));
}

}  // namespace rig::daemon
