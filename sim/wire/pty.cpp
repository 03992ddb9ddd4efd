#include "sim/wire/pty.h"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <mutex>
#include <poll.h>
#include <pty.h>
#include <system_error>
#include <termios.h>
#include <thread>
#include <unistd.h>

namespace rig::sim::wire {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

struct Pty::State {
  std::mutex mutex;
  int master = -1;
  // The device keeps the line's other end open too: else a driver that has not come yet looks like a hang-up.
  int slave = -1;
};

Pty::Pty(fs::path link) : link_(std::move(link)), state_(std::make_unique<State>()) {
  make();
}

Pty::~Pty() {
  cut();
}

void Pty::make() {
  std::array<char, 256> name{};
  termios raw{};
  ::cfmakeraw(&raw);
  if (::openpty(&state_->master, &state_->slave, name.data(), &raw, nullptr) != 0) {
    throw std::system_error(errno, std::generic_category(), "openpty");
  }
  ::fcntl(state_->master, F_SETFL, O_NONBLOCK);
  ::fcntl(state_->master, F_SETFD, FD_CLOEXEC);
  ::fcntl(state_->slave, F_SETFD, FD_CLOEXEC);
  fs::remove(link_);
  fs::create_symlink(name.data(), link_);
}

std::string Pty::read(milliseconds within) {
  const auto deadline = std::chrono::steady_clock::now() + within;
  // Looked at in short turns, so that cut() need not wait for the reader.
  constexpr milliseconds kTurn{5};
  while (true) {
    int fd = -1;
    {
      const std::lock_guard lock(state_->mutex);
      fd = state_->master;
      if (fd >= 0) {
        std::array<char, 4096> buffer{};
        const ssize_t n = ::read(fd, buffer.data(), buffer.size());
        if (n > 0) return {buffer.data(), static_cast<std::size_t>(n)};
      }
    }
    if (std::chrono::steady_clock::now() >= deadline) return {};
    pollfd wait{fd, POLLIN, 0};
    if (wait.fd < 0) {
      std::this_thread::sleep_for(kTurn);
    } else {
      (void)::poll(&wait, 1, static_cast<int>(kTurn.count()));
    }
  }
}

void Pty::write(std::string_view bytes) {
  const std::lock_guard lock(state_->mutex);
  while (state_->master >= 0 && !bytes.empty()) {
    const ssize_t n = ::write(state_->master, bytes.data(), bytes.size());
    if (n <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
}

void Pty::cut() {
  const std::lock_guard lock(state_->mutex);
  if (state_->master < 0) return;
  ::close(state_->slave);
  ::close(state_->master);
  state_->master = state_->slave = -1;
  std::error_code already_gone;
  fs::remove(link_, already_gone);
}

void Pty::restore() {
  const std::lock_guard lock(state_->mutex);
  if (state_->master < 0) make();
}

bool Pty::is_cut() {
  const std::lock_guard lock(state_->mutex);
  return state_->master < 0;
}

}  // namespace rig::sim::wire
