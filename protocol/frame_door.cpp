#include "protocol/frame_door.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <poll.h>
#include <string>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "core/base/thread.h"
#include "protocol/socket_folder.h"

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;

namespace {

constexpr int kWaitingToConnect = 16;
constexpr int kTryAgain_ms = 100;
// Beyond it a newcomer is turned away: each costs a send a frame.
constexpr std::size_t kMostClients = 64;

struct Client {
  int fd = -1;
  std::uint64_t missed = 0;
};

enum class Handed { yes, full, gone };

Handed hand_over(int fd, const std::string& bytes, int descriptor) {
  iovec part{const_cast<char*>(bytes.data()), bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
  if (::sendmsg(fd, &message, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) return Handed::yes;
  return errno == EAGAIN || errno == ENOBUFS || errno == ETOOMANYREFS ? Handed::full : Handed::gone;
}

}  // namespace

struct FrameDoor::State {
  fs::path path;
  int listening = -1;
  int wake = -1;
  mutable std::mutex mutex;
  std::vector<Client> clients;
  std::thread thread;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (thread.joinable()) {
      const std::uint64_t one = 1;
      (void)!::write(wake, &one, sizeof one);
      thread.join();
    }
    for (const Client& client : clients) ::close(client.fd);
    if (listening >= 0) {
      ::close(listening);
      std::error_code already_gone;
      fs::remove(path, already_gone);
    }
    if (wake >= 0) ::close(wake);
  }

  // Lets clients in until the end. Those that went are found when something is sent to them.
  void run() {
    std::array<pollfd, 2> polled{{{listening, POLLIN, 0}, {wake, POLLIN, 0}}};
    while (true) {
      ::poll(polled.data(), polled.size(), -1);
      if (polled[1].revents != 0) return;
      const int fd = ::accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (fd < 0) {
        ::poll(&polled[1], 1, kTryAgain_ms);  // too many open files: it may pass
        continue;
      }
      const std::lock_guard lock(mutex);
      if (clients.size() >= kMostClients) {
        ::close(fd);
      } else {
        clients.push_back({fd, 0});
      }
    }
  }
};

FrameDoor::FrameDoor(std::unique_ptr<State> state) : state_(std::move(state)) {}
FrameDoor::~FrameDoor() = default;

base::Result<std::unique_ptr<FrameDoor>> FrameDoor::open(const fs::path& folder, const std::string& group) {
  auto state = std::make_unique<State>();
  state->path = folder / "frames.sock";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = state->path.string();
  if (name.size() >= sizeof address.sun_path)
    return fail(ErrorCode::bad_input, "the path is too long for a socket", name,
                "choose a shorter --runtime");
  name.copy(address.sun_path, sizeof address.sun_path - 1);
  // A left-over of a rigd that was killed: the folder is ours.
  std::error_code told_by_bind;
  if (fs::is_socket(state->path, told_by_bind)) fs::remove(state->path, told_by_bind);
  state->wake = ::eventfd(0, EFD_CLOEXEC);
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  // Nobody but the owner may connect before the group is right.
  const mode_t before = ::umask(0177);
  const bool bound = fd >= 0 && ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = errno;
  ::umask(before);
  if (!bound) {
    if (fd >= 0) ::close(fd);
    return fail(ErrorCode::io, fmt::format("cannot listen: {}", std::strerror(error)), name);
  }
  state->listening = fd;
  if (auto given = give_to_group(state->path, group); !given) return base::pass(given);
  if (::listen(fd, kWaitingToConnect) != 0)
    return fail(ErrorCode::io, fmt::format("cannot listen: {}", std::strerror(errno)), name);
  State* running = state.get();
  state->thread = std::thread([running] {
    base::name_thread("frames");
    running->run();
  });
  return std::unique_ptr<FrameDoor>(new FrameDoor(std::move(state)));
}

void FrameDoor::publish(const LocalFrame& frame, const FrameBuffer& buffer) {
  const std::lock_guard lock(state_->mutex);
  LocalFrame told = frame;
  std::erase_if(state_->clients, [&](Client& client) {
    told.set_missed(client.missed);
    switch (hand_over(client.fd, told.SerializeAsString(), buffer.descriptor())) {
      case Handed::yes:
        client.missed = 0;
        return false;
      case Handed::full:
        ++client.missed;
        return false;
      case Handed::gone:
        break;
    }
    ::close(client.fd);
    return true;
  });
}

std::size_t FrameDoor::clients() const {
  const std::lock_guard lock(state_->mutex);
  return state_->clients.size();
}

}  // namespace rig::protocol
