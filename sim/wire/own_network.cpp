#include "sim/wire/own_network.h"

#include <cstring>
#include <fstream>
#include <net/if.h>
#include <sched.h>
#include <string>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace rig::sim::wire {

namespace {

bool switch_loopback_on() {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return false;
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  bool on = ::ioctl(fd, SIOCGIFFLAGS, &request) == 0;
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_RUNNING);
  on = on && ::ioctl(fd, SIOCSIFFLAGS, &request) == 0;
  ::close(fd);
  return on;
}

}  // namespace

bool enter_own_network() {
  const uid_t user = ::getuid();
  const gid_t group = ::getgid();
  if (user == 0) return ::unshare(CLONE_NEWNET) == 0 && switch_loopback_on();
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
  std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
  return switch_loopback_on();
}

}  // namespace rig::sim::wire
