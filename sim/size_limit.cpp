#include "sim/size_limit.h"

#include <algorithm>
#include <csignal>

namespace rig::sim {

namespace {

constexpr rlim_t kBlock_bytes = 4096;

}  // namespace

SizeLimit::SizeLimit() {
  // Else the first write beyond the limit ends the process.
  if (struct sigaction now{}; ::sigaction(SIGXFSZ, nullptr, &now) == 0 && now.sa_handler == SIG_DFL)
    ::signal(SIGXFSZ, SIG_IGN);
  if (::getrlimit(RLIMIT_FSIZE, &before_) != 0) return;
  const rlimit limit{std::min(before_.rlim_cur, kBlock_bytes), before_.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &limit);
}

SizeLimit::~SizeLimit() {
  ::setrlimit(RLIMIT_FSIZE, &before_);
}

}  // namespace rig::sim
