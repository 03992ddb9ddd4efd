#include "sim/wire/can_hub.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <linux/can/error.h>
#include <map>
#include <mutex>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <vector>

#include "sim/wire/promptness.h"

namespace rig::sim::wire {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

struct Order {
  CanHub::Fault fault;
  canid_t id;
  int frames;
  milliseconds late;
};

struct Waiting {
  can_frame frame;
  int from;
  Steady::time_point due;
};

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

int listen_at(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    fail("the path of a CAN hub");
  }
  std::memcpy(address.sun_path, path.c_str(), path.native().size() + 1);
  fs::remove(path);
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) fail("socket");
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || ::listen(fd, 16) != 0) {
    ::close(fd);
    fail("listening at the path of a CAN hub");
  }
  return fd;
}

}  // namespace

struct CanHub::State {
  std::mutex mutex;
  int wake = -1;
  int listener = -1;
  bool ends = false;
  bool is_bus_off = false;
  std::map<int, bool> peers;  // descriptor, whether it connected from outside
  std::deque<Order> orders;
  std::deque<Waiting> waiting;
  std::uint32_t noise = 0x9E3779B9;
  std::function<void(const can_frame&)> listener_of_frames;
  std::thread thread;

  void wake_up() const {
    const std::uint64_t one = 1;
    (void)!::write(wake, &one, sizeof one);
  }
  // What a peer does not read is lost to it, as in a controller whose buffer overflows.
  static void put(int to, const can_frame& frame) {
    (void)::send(to, &frame, sizeof frame, MSG_DONTWAIT | MSG_NOSIGNAL);
  }

  void pass_on(int from, const can_frame& frame) {
    for (const auto& [fd, outside] : peers) {
      if (fd != from && !(outside && is_bus_off)) put(fd, frame);
    }
  }
  void to_outside(const can_frame& frame) {
    for (const auto& [fd, outside] : peers) {
      if (outside) put(fd, frame);
    }
  }
  void garble(can_frame& frame) {
    for (unsigned i = 0; i < frame.can_dlc; ++i) {
      noise ^= noise << 13U;
      noise ^= noise >> 17U;
      noise ^= noise << 5U;
      frame.data[i] = static_cast<std::uint8_t>(frame.data[i] ^ (noise | 1U));
    }
  }
  void take(int from, can_frame frame) {
    if (listener_of_frames) listener_of_frames(frame);
    const auto peer = peers.find(from);
    if (peer != peers.end() && peer->second && is_bus_off) return;
    const auto held = std::any_of(waiting.begin(), waiting.end(),
                                  [&](const Waiting& w) { return w.frame.can_id == frame.can_id; });
    const auto order =
        std::find_if(orders.begin(), orders.end(), [&](const Order& o) { return o.id == frame.can_id; });
    if (order == orders.end()) {
      if (held) {
        waiting.push_back({frame, from, Steady::now()});
      } else {
        pass_on(from, frame);
      }
      return;
    }
    const Order now = *order;
    if (--order->frames == 0) orders.erase(order);
    switch (now.fault) {
      case Fault::drop:
        return;
      case Fault::garble:
        garble(frame);
        break;
      case Fault::duplicate:
        pass_on(from, frame);
        break;
      case Fault::drop_two_of_three:
        if (now.frames % 3 != 0) return;
        break;
      case Fault::delay:
        waiting.push_back({frame, from, Steady::now() + now.late});
        return;
    }
    pass_on(from, frame);
  }
  // Those of one identifier in the order in which they came.
  void release_due() {
    std::vector<canid_t> blocked;
    for (auto it = waiting.begin(); it != waiting.end();) {
      const bool is_blocked = std::find(blocked.begin(), blocked.end(), it->frame.can_id) != blocked.end();
      if (is_blocked || it->due > Steady::now()) {
        blocked.push_back(it->frame.can_id);
        ++it;
      } else {
        pass_on(it->from, it->frame);
        it = waiting.erase(it);
      }
    }
  }
  void hang_up_outside() {
    for (auto it = peers.begin(); it != peers.end();) {
      if (it->second) ::close(it->first);
      it = it->second ? peers.erase(it) : std::next(it);
    }
  }
};

CanHub::CanHub(fs::path path) : path_(std::move(path)), state_(std::make_unique<State>()) {
  state_->wake = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (state_->wake < 0) fail("eventfd");
  state_->listener = listen_at(path_);
  state_->thread = std::thread([this] { run(); });
}

CanHub::~CanHub() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ends = true;
    state_->wake_up();
  }
  state_->thread.join();
  for (const auto& [fd, outside] : state_->peers) ::close(fd);
  if (state_->listener >= 0) ::close(state_->listener);
  ::close(state_->wake);
  std::error_code already_gone;
  fs::remove(path_, already_gone);
}

void CanHub::run() {
  answer_promptly();
  State& s = *state_;
  while (true) {
    std::vector<pollfd> watched;
    int wait_ms = -1;
    {
      const std::lock_guard lock(s.mutex);
      if (s.ends) return;
      watched.push_back({s.wake, POLLIN, 0});
      if (s.listener >= 0) watched.push_back({s.listener, POLLIN, 0});
      for (const auto& [fd, outside] : s.peers) watched.push_back({fd, POLLIN, 0});
      if (!s.waiting.empty()) wait_ms = 1;
    }
    (void)::poll(watched.data(), watched.size(), wait_ms);
    const std::lock_guard lock(s.mutex);
    std::uint64_t woken = 0;
    (void)!::read(s.wake, &woken, sizeof woken);
    if (s.listener >= 0) {
      const int fd = ::accept4(s.listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (fd >= 0) s.peers.emplace(fd, true);
    }
    for (const pollfd& one : watched) {
      // A descriptor that was closed meanwhile is no peer any more.
      if (one.revents == 0 || s.peers.find(one.fd) == s.peers.end()) continue;
      can_frame frame{};
      ssize_t n = 0;
      while ((n = ::recv(one.fd, &frame, sizeof frame, MSG_DONTWAIT)) == sizeof frame) s.take(one.fd, frame);
      if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
        ::close(one.fd);
        s.peers.erase(one.fd);
      }
    }
    s.release_due();
  }
}

int CanHub::attach() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0) fail("socketpair");
  const std::lock_guard lock(state_->mutex);
  state_->peers.emplace(ends[0], false);
  state_->wake_up();
  return ends[1];
}

void CanHub::spoil(Fault fault, canid_t id, int frames, milliseconds late) {
  const std::lock_guard lock(state_->mutex);
  if (frames > 0) state_->orders.push_back({fault, id, frames, late});
}

void CanHub::heal() {
  const std::lock_guard lock(state_->mutex);
  state_->orders.clear();
  state_->waiting.clear();
}

void CanHub::take_down() {
  const std::lock_guard lock(state_->mutex);
  if (state_->listener < 0) return;
  ::close(state_->listener);
  state_->listener = -1;
  state_->hang_up_outside();
  state_->waiting.clear();
  std::error_code already_gone;
  fs::remove(path_, already_gone);
  state_->wake_up();
}

void CanHub::bring_up() {
  const std::lock_guard lock(state_->mutex);
  if (state_->listener < 0) state_->listener = listen_at(path_);
  state_->wake_up();
}

void CanHub::set_bus_off(bool off) {
  const std::lock_guard lock(state_->mutex);
  if (state_->is_bus_off == off) return;
  state_->is_bus_off = off;
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | (off ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED);
  frame.can_dlc = CAN_ERR_DLC;
  state_->to_outside(frame);
}

void CanHub::inject(const can_frame& frame) {
  const std::lock_guard lock(state_->mutex);
  state_->to_outside(frame);
}

void CanHub::listen(std::function<void(const can_frame&)> listener) {
  const std::lock_guard lock(state_->mutex);
  state_->listener_of_frames = std::move(listener);
}

}  // namespace rig::sim::wire
