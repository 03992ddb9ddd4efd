#include "sim/wire/control_socket.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <system_error>
#include <thread>
#include <unistd.h>

namespace rig::sim::wire {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

constexpr std::size_t kTagBytes = 4;
constexpr std::size_t kSetupBytes = 8;
constexpr std::size_t kMostBytes = 4096;
constexpr milliseconds kTurn{5};

[[noreturn]] void give_up(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

int listen_at(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof(address.sun_path)) {
    throw std::system_error(ENAMETOOLONG, std::generic_category(), path.native());
  }
  std::memcpy(address.sun_path, path.c_str(), path.native().size());
  fs::remove(path);
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) give_up("socket");
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) give_up("bind");
  if (::listen(fd, 8) != 0) give_up("listen");
  return fd;
}

struct LateAnswer {
  Steady::time_point at;
  int fd;
  std::vector<std::uint8_t> bytes;
};

}  // namespace

struct ControlSocket::Impl {
  Impl(fs::path where, ControlHandler answers) : path(std::move(where)), handler(std::move(answers)) {}

  const fs::path path;
  const ControlHandler handler;
  std::mutex mutex;  // guards all below; held while a request is carried out
  int listening = -1;
  std::vector<int> clients;
  std::vector<LateAnswer> late;
  Spoil spoil = Spoil::missing;
  int spoilt_answers = 0;
  milliseconds late_by{0};
  std::atomic<bool> ending{false};
  std::thread thread;

  void throw_out(int client) {
    ::close(client);
    std::erase(clients, client);
    std::erase_if(late, [client](const LateAnswer& l) { return l.fd == client; });
  }

  void close_all() {
    while (!clients.empty()) throw_out(clients.back());
    if (listening >= 0) ::close(listening);
    listening = -1;
    std::error_code gone;
    fs::remove(path, gone);
  }

  static void send(int client, const std::vector<std::uint8_t>& bytes) {
    (void)::send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

  void answer(int client, std::span<const std::uint8_t> message) {
    const SetupPacket setup = parse_setup(message.subspan(kTagBytes).first<kSetupBytes>());
    ControlAnswer got = handler(setup, message.subspan(kTagBytes + kSetupBytes));
    if (got.kind == ControlAnswer::Kind::silence) return;
    if (got.data.size() > setup.length) got.data.resize(setup.length);
    std::vector<std::uint8_t> bytes(message.begin(), message.begin() + kTagBytes);
    bytes.push_back(got.kind == ControlAnswer::Kind::stall ? 1 : 0);
    bytes.insert(bytes.end(), got.data.begin(), got.data.end());
    if (spoilt_answers == 0) return send(client, bytes);
    --spoilt_answers;
    switch (spoil) {
      case Spoil::missing:
        return;
      case Spoil::garbage:
        // The tag is the carrier's, as a USB host's own bookkeeping is; what the device said is not to be
        // known.
        std::fill(bytes.begin() + kTagBytes, bytes.end(), std::uint8_t{0xEE});
        return send(client, bytes);
      case Spoil::late:
        late.push_back({Steady::now() + late_by, client, std::move(bytes)});
        return;
      case Spoil::duplicate:
        send(client, bytes);
        return send(client, bytes);
      case Spoil::two_of_three:
        if (spoilt_answers % 3 == 0) send(client, bytes);
        return;
    }
  }

  void serve(int client) {
    std::array<std::uint8_t, kMostBytes> buffer{};
    const ssize_t n = ::recv(client, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (n < static_cast<ssize_t>(kTagBytes + kSetupBytes)) return throw_out(client);
    answer(client, std::span(buffer).first(static_cast<std::size_t>(n)));
  }

  void send_late() {
    const auto now = Steady::now();
    for (const LateAnswer& l : late) {
      if (l.at <= now) send(l.fd, l.bytes);
    }
    std::erase_if(late, [now](const LateAnswer& l) { return l.at <= now; });
  }

  void run() {
    while (!ending) {
      std::vector<pollfd> waited;
      {
        const std::lock_guard lock(mutex);
        for (const int client : clients) waited.push_back({client, POLLIN, 0});
        if (listening >= 0) waited.push_back({listening, POLLIN, 0});
      }
      (void)::poll(waited.data(), waited.size(), static_cast<int>(kTurn.count()));
      const std::lock_guard lock(mutex);
      send_late();
      for (const int client : std::vector<int>(clients)) serve(client);
      if (listening < 0) continue;
      const int fresh = ::accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (fresh >= 0) clients.push_back(fresh);
    }
  }
};

ControlSocket::ControlSocket(fs::path path, ControlHandler handler)
    : impl_(std::make_unique<Impl>(std::move(path), std::move(handler))) {
  impl_->listening = listen_at(impl_->path);
  impl_->thread = std::thread([this] { impl_->run(); });
}

ControlSocket::~ControlSocket() {
  impl_->ending = true;
  impl_->thread.join();
  impl_->close_all();
}

const fs::path& ControlSocket::path() const {
  return impl_->path;
}

void ControlSocket::spoil(Spoil how, int answers, milliseconds late) {
  const std::lock_guard lock(impl_->mutex);
  impl_->spoil = how;
  impl_->spoilt_answers = answers;
  impl_->late_by = late;
}

void ControlSocket::cut() {
  const std::lock_guard lock(impl_->mutex);
  impl_->close_all();
}

void ControlSocket::restore() {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->listening < 0) impl_->listening = listen_at(impl_->path);
}

bool ControlSocket::in_use() {
  const std::lock_guard lock(impl_->mutex);
  return !impl_->clients.empty();
}

}  // namespace rig::sim::wire
