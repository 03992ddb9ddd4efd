#include "sim/wire/canopen_station.h"

#include <cerrno>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdexcept>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>

#include "sim/wire/promptness.h"

namespace rig::sim::wire {

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

CanopenStation::CanopenStation(int fd, const std::vector<CanopenNode::Settings>& nodes) : fd_(fd) {
  for (const auto& settings : nodes) {
    nodes_.push_back(std::make_unique<CanopenNode>(settings));
    nodes_.back()->power_on(Steady::now());
  }
  thread_ = std::thread([this] { run(); });
}

CanopenStation::~CanopenStation() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  thread_.join();
  ::close(fd_);
}

CanopenNode& CanopenStation::node(int id) {
  for (const auto& one : nodes_) {
    if (one->settings().id == id) return *one;
  }
  throw std::out_of_range("there is no such node");
}

std::vector<int> CanopenStation::ids() const {
  std::vector<int> ids;
  ids.reserve(nodes_.size());
  for (const auto& one : nodes_) ids.push_back(one->settings().id);
  return ids;
}

void CanopenStation::listen(std::function<void(const can_frame&)> listener) {
  const std::lock_guard lock(mutex_);
  listener_ = std::move(listener);
}

void CanopenStation::unplug(bool out) {
  const std::lock_guard lock(mutex_);
  is_out_ = out;
}

void CanopenStation::power_cycle(int id) {
  with(id, [](CanopenNode& node, CanopenNode::Time now) {
    node.power_off(now);
    node.power_on(now);
  });
  const auto end = Steady::now() + std::chrono::seconds(10);
  while (!with(id, [](CanopenNode& node, CanopenNode::Time) { return node.is_up(); })) {
    if (Steady::now() > end) throw std::runtime_error("a simulated node does not boot");
    std::this_thread::sleep_for(milliseconds(1));
  }
}

void CanopenStation::run() {
  answer_promptly();
  while (true) {
    pollfd wait{fd_, POLLIN, 0};
    (void)::poll(&wait, 1, 1);
    // A bus that hung up wakes at once for ever.
    if ((wait.revents & (POLLHUP | POLLERR)) != 0) std::this_thread::sleep_for(milliseconds(1));
    const std::lock_guard lock(mutex_);
    if (ends_) return;
    can_frame frame{};
    while (::recv(fd_, &frame, sizeof frame, MSG_DONTWAIT) == sizeof frame) {
      if (is_out_ || (frame.can_id & CAN_ERR_FLAG) != 0) continue;
      if (listener_) listener_(frame);
      for (const auto& node : nodes_) node->receive(Steady::now(), frame);
    }
    for (const auto& node : nodes_) {
      for (const can_frame& answer : node->tick(Steady::now())) {
        if (is_out_) continue;
        if (listener_) listener_(answer);
        (void)::send(fd_, &answer, sizeof answer, MSG_DONTWAIT | MSG_NOSIGNAL);
      }
    }
  }
}

int open_can_interface(const std::string& name) {
  const auto failed = [&](const char* what, int fd) {
    const int error = errno;
    if (fd >= 0) ::close(fd);
    throw std::system_error(error, std::generic_category(), name + ": " + what);
  };
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
  if (fd < 0) failed("this system has no CAN sockets", fd);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(name.c_str()));
  if (address.can_ifindex == 0) failed("there is no such interface", fd);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) failed("bind", fd);
  return fd;
}

}  // namespace rig::sim::wire
