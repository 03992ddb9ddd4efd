#include "drivers/tic_axis/feeder.h"

namespace rig::drivers::tic {

using std::chrono::duration_cast;
using std::chrono::milliseconds;

Feeder::Feeder(Link& link, const Heartbeat& heart, const FeederTimes& times, Tell tell)
    : link_(link), heart_(heart), times_(times), tell_(std::move(tell)), thread_([this] { run(); }) {}

Feeder::~Feeder() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ending_changed_.notify_all();
  thread_.join();
}

bool Feeder::wait() {
  std::unique_lock lock(mutex_);
  return !ending_changed_.wait_for(lock, times_.every, [this] { return ending_; });
}

void Feeder::run() {
  bool fasting = false;
  do {
    const auto age = heart_.age();
    const bool silent = age > times_.silence;
    if (silent && !fasting) {
      tell_(fmt::format("no call for {} ms: its command timeout is not fed any more, it brakes by itself",
                        duration_cast<milliseconds>(age).count()));
    }
    if (!silent && fasting) tell_("calls come again: its command timeout is fed again");
    fasting = silent;
    // A Tic that is gone is found out and told of by the worker's next call, which closes this link.
    if (!silent) (void)link_.feed();
  } while (wait());
}

}  // namespace rig::drivers::tic
