#include "sim/wire/vhci.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <sstream>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/files.h"

namespace rig::sim::wire {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// A file of sysfs takes its text in one write.
Result<void> put(const fs::path& file, const std::string& text) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
  const bool done = fd >= 0 && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int why = errno;
  if (fd >= 0) ::close(fd);
  if (done) return {};
  return fail(ErrorCode::io, fmt::format("cannot write '{}': {}", text, std::strerror(why)), file.string());
}

}  // namespace

std::optional<int> free_vhci_port(std::string_view status) {
  // hub port sta spd dev ...: "hs  0003 004 000 ..."; 4 is a port with nothing in it. Older kernels have no
  // first column, and ports of high speed only.
  constexpr int kEmpty = 4;
  std::istringstream lines{std::string(status)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "ss") continue;
    if (word == "hs" && !(words >> word)) continue;
    int port = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), port);
    if (error != std::errc() || end != word.data() + word.size()) continue;
    int state = 0;
    if (words >> std::dec >> state && state == kEmpty) return port;
  }
  return std::nullopt;
}

Result<std::unique_ptr<VhciPlug>> VhciPlug::plug_in(ControlHandler control, UsbSpeed speed,
                                                    UsbIpDevice::OutHandler out, const fs::path& vhci) {
  const auto status = base::read_file(vhci / "status");
  if (!status) {
    return fail(ErrorCode::not_found, "there is no virtual USB host controller", vhci.string(),
                "modprobe vhci-hcd");
  }
  const auto port = free_vhci_port(*status);
  if (!port)
    return fail(ErrorCode::busy, "every port of the virtual USB host controller is taken", vhci.string());
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return fail(ErrorCode::io, fmt::format("socketpair: {}", std::strerror(errno)));
  }
  auto device = std::make_unique<UsbIpDevice>(ends[1], std::move(control), std::move(out));
  // Bus and device on the far host, which the kernel only hands back with every request.
  constexpr std::uint32_t kNumber = 0x10001;
  auto plugged =
      put(vhci / "attach", fmt::format("{} {} {} {}", *port, ends[0], kNumber, static_cast<int>(speed)));
  // The kernel holds the socket itself now.
  ::close(ends[0]);
  if (!plugged) return pass(plugged);
  return std::unique_ptr<VhciPlug>(new VhciPlug(vhci, *port, std::move(device)));
}

VhciPlug::~VhciPlug() {
  // Refused where the kernel has taken it off already because the device hung up.
  (void)put(vhci_ / "detach", std::to_string(port_));
}

}  // namespace rig::sim::wire
