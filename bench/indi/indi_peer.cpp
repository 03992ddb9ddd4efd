#include "bench/indi/indi_peer.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <optional>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace rig::bench {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;
using Steady = std::chrono::steady_clock;

namespace {

constexpr std::size_t kRoom = std::size_t{64} << 20;  // a frame of 24 MiB in base64 and more
constexpr int kNotInstalled = 127;
constexpr std::chrono::seconds kStartPatience{10};

sockaddr_in address_of(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

// indiserver takes no port 0; this one was free a moment ago.
std::uint16_t free_port() {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = address_of(0);
  socklen_t size = sizeof address;
  (void)::bind(fd, reinterpret_cast<const sockaddr*>(&address), size);
  (void)::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(fd);
  return ntohs(address.sin_port);
}

std::optional<int> connected(std::uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = address_of(port);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(fd);
    return std::nullopt;
  }
  // As INDI's own clients and ZeroMQ do: no small message waits for the one before.
  const int on = 1;
  (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return fd;
}

pid_t start_server(const std::string& driver, const fs::path& folder, std::uint16_t port) {
  const std::string log = (folder / "indi.log").string();
  std::vector<std::string> arguments{
      "indiserver", "-p", std::to_string(port), "-m", "1000", "-u", (folder / "indi.sock").string(), driver};
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  ::setenv("HOME", folder.c_str(), 1);  // where drivers keep their settings
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (out < 0 || ::dup2(out, 1) < 0 || ::dup2(out, 2) < 0) ::_exit(126);
  ::execvp(argv[0], argv.data());
  ::_exit(kNotInstalled);
}

}  // namespace

IndiPeer::IndiPeer(pid_t pid, int socket) : pid_(pid), socket_(socket), bytes_(kRoom) {}

IndiPeer::~IndiPeer() {
  if (socket_ >= 0) ::close(socket_);
  if (pid_ <= 0) return;
  ::kill(pid_, SIGTERM);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

Result<IndiPeer> IndiPeer::start(const std::string& driver, const fs::path& folder) {
  std::error_code told_by_the_server;
  fs::create_directories(folder, told_by_the_server);
  const std::uint16_t port = free_port();
  IndiPeer peer(start_server(driver, folder, port), -1);
  if (peer.pid_ < 0) return fail(ErrorCode::io, "cannot start a process", "indiserver");
  const auto until = Steady::now() + kStartPatience;
  while (Steady::now() < until) {
    int status = 0;
    if (::waitpid(peer.pid_, &status, WNOHANG) == peer.pid_) {
      peer.pid_ = -1;
      if (WIFEXITED(status) && WEXITSTATUS(status) == kNotInstalled)
        return fail(ErrorCode::device, "indiserver is not installed", {}, "apt-get install indi-bin");
      return fail(ErrorCode::device, "indiserver ended by itself", (folder / "indi.log").string());
    }
    if (const auto fd = connected(port)) {
      peer.socket_ = *fd;
      return peer;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return fail(ErrorCode::timeout, "indiserver does not listen", (folder / "indi.log").string());
}

Result<void> IndiPeer::send(std::string_view xml) const {
  while (!xml.empty()) {
    const auto sent = ::send(socket_, xml.data(), xml.size(), MSG_NOSIGNAL);
    if (sent < 0) return fail(ErrorCode::io, fmt::format("cannot send: {}", std::strerror(errno)), "INDI");
    xml.remove_prefix(static_cast<std::size_t>(sent));
  }
  return {};
}

Result<std::string_view> IndiPeer::read_to(std::string_view end, std::chrono::seconds patience) {
  const auto until = Steady::now() + patience;
  std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(taken_),
            bytes_.begin() + static_cast<std::ptrdiff_t>(filled_), bytes_.begin());
  filled_ -= std::exchange(taken_, 0);
  std::size_t looked = 0;
  while (true) {
    const std::string_view text(bytes_.data(), filled_);
    if (const auto at = text.find(end, looked); at != std::string_view::npos) {
      taken_ = at + end.size();
      return text.substr(0, taken_);
    }
    looked = filled_ - std::min(filled_, end.size() - 1);
    pollfd polled{socket_, POLLIN, 0};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Steady::now()).count();
    if (left <= 0 || ::poll(&polled, 1, static_cast<int>(left)) == 0)
      return fail(ErrorCode::timeout, fmt::format("no '{}' came from indiserver", end));
    const auto got = ::recv(socket_, bytes_.data() + filled_, bytes_.size() - filled_, 0);
    if (got <= 0) return fail(ErrorCode::io, "indiserver ended the connection, or sent too much", "INDI");
    filled_ += static_cast<std::size_t>(got);
  }
}

}  // namespace rig::bench
