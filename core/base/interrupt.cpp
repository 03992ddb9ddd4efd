#include "core/base/interrupt.h"

#include <csignal>

namespace rig::base {

namespace {

volatile std::sig_atomic_t asked_to_end = 0;

extern "C" void on_signal(int signal) {
  asked_to_end = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, &on_signal);
  std::signal(SIGTERM, &on_signal);
}

bool interrupted() {
  return asked_to_end != 0;
}

tl::unexpected<Error> interrupted_error(std::string left) {
  return fail(ErrorCode::interrupted, "interrupted", {}, std::move(left));
}

}  // namespace rig::base
