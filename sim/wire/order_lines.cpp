#include "sim/wire/order_lines.h"

#include <array>
#include <cstdio>
#include <poll.h>
#include <unistd.h>

#include "core/base/interrupt.h"

namespace rig::sim::wire {

namespace {

void say(const std::string& line) {
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

}  // namespace

void complain_of(const std::string& program, const base::Error& error) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), error.text().c_str());
}

std::string obey_order(const OrderedDevice& device, const std::string& order) {
  base::Result<std::string> said;
  if (order == "unplug") {
    device.unplug();
  } else if (order == "plug") {
    if (auto done = device.plug(); !done) said = base::pass(done);
  } else {
    said = device.carry_out(order);
  }
  if (said) return said->empty() ? "ok" : *said;
  complain_of(device.program, said.error());
  return "refused";
}

int serve_order_lines(const OrderedDevice& device) {
  constexpr int kTurn_ms = 50;
  if (const auto plugged = device.plug(); !plugged) {
    complain_of(device.program, plugged.error());
    return 1;
  }
  say("ready");
  std::string come;
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!base::interrupted()) {
    if (::poll(&input, 1, kTurn_ms) <= 0) continue;
    std::array<char, 1024> buffer{};
    const ssize_t n = ::read(STDIN_FILENO, buffer.data(), buffer.size());
    if (n <= 0) {
      input.fd = -1;
      continue;
    }
    come.append(buffer.data(), static_cast<std::size_t>(n));
    for (auto end = come.find('\n'); end != std::string::npos; end = come.find('\n')) {
      say(obey_order(device, come.substr(0, end)));
      come.erase(0, end + 1);
    }
  }
  return 0;
}

}  // namespace rig::sim::wire
