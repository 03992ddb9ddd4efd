#include "core/base/thread.h"

#include <array>
#include <cstdio>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

namespace rig::base {

namespace {

// A third of the others' weight: behind them, and yet not starved by what else runs on the machine.
constexpr int kAside = 5;

}  // namespace

void name_thread(const char* name) {
  std::array<char, 16> kept{};
  std::snprintf(kept.data(), kept.size(), "%s", name);
  ::pthread_setname_np(::pthread_self(), kept.data());
}

void give_way_to_others() {
  // On Linux this is the thread's own, although POSIX has it as the process's (setpriority(2)).
  const auto thread = static_cast<id_t>(::gettid());
  const int now = ::getpriority(PRIO_PROCESS, thread);
  (void)::setpriority(PRIO_PROCESS, thread, now + kAside);
}

}  // namespace rig::base
