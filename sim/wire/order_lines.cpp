#include "sim/wire/order_lines.h"

#include <array>
#include <poll.h>
#include <unistd.h>

#include "core/base/interrupt.h"

namespace rig::sim::wire {

void serve_order_lines(const std::function<void(const std::string& line)>& obey) {
  constexpr int kTurn_ms = 50;
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
      obey(come.substr(0, end));
      come.erase(0, end + 1);
    }
  }
}

}  // namespace rig::sim::wire
