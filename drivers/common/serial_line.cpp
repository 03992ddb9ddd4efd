#include "drivers/common/serial_line.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>
#include <utility>

#include "drivers/common/serial_port.h"

namespace rig::drivers {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

int time_left_ms(Steady::time_point deadline) {
  const auto left = std::chrono::ceil<milliseconds>(deadline - Steady::now()).count();
  return static_cast<int>(std::max<milliseconds::rep>(left, 0));
}

Result<void> set_up(int fd, const SerialSettings& settings) {
  const auto failed = [&](const char* what) {
    return fail(ErrorCode::io, fmt::format("{}: {}", what, std::strerror(errno)), settings.path);
  };
  termios mode{};
  if (::tcgetattr(fd, &mode) != 0) return failed("this is no serial line");
  ::cfmakeraw(&mode);
  mode.c_cflag |= CLOCAL | CREAD;
  mode.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB | PARODD);
  if (settings.stop_bits == 2) mode.c_cflag |= CSTOPB;
  if (settings.parity != 'N') {
    mode.c_cflag |= PARENB;
    mode.c_iflag |= INPCK;
  }
  if (settings.parity == 'O') mode.c_cflag |= PARODD;
  mode.c_cc[VMIN] = 0;
  mode.c_cc[VTIME] = 0;
  // The library takes a number of bauds as well as its code.
  ::cfsetspeed(&mode, static_cast<speed_t>(settings.baud));
  if (::tcsetattr(fd, TCSANOW, &mode) != 0) return failed("the line cannot be set up");
  // tcsetattr is content when anything could be set.
  if (auto fine = check_speed(fd, settings.baud, settings.path); !fine) return fine;
  ::tcflush(fd, TCIOFLUSH);
  return {};
}

}  // namespace

SerialSettings read_serial_settings(const base::ConfigTable& settings, const SerialSettings& usual) {
  SerialSettings serial = usual;
  serial.path = settings.text("port");
  serial.baud = static_cast<int>(settings.integer_or("baud", usual.baud, 1200, 921600));
  if (!is_serial_speed(serial.baud)) {
    settings.error("baud", fmt::format("no serial line runs at {} baud", serial.baud),
                   "9600, 19200, 38400, 57600, 115200, ...");
  }
  const char* name = usual.parity == 'E' ? "even" : usual.parity == 'O' ? "odd" : "none";
  const std::string parity = settings.choice_or("parity", name, {"none", "even", "odd"});
  serial.parity = parity == "even" ? 'E' : parity == "odd" ? 'O' : 'N';
  serial.stop_bits = static_cast<int>(settings.integer_or("stop_bits", usual.stop_bits, 1, 2));
  return serial;
}

Result<std::unique_ptr<SerialLine>> SerialLine::open(const SerialSettings& settings) {
  const int fd = ::open(settings.path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    return fail(ErrorCode::lost, fmt::format("cannot open the serial line: {}", std::strerror(errno)),
                settings.path,
                errno == EACCES ? "is rigd in the group that owns it (dialout)?" : "is it plugged in?");
  }
  std::unique_ptr<SerialLine> line(new SerialLine(settings, fd));
  if (auto ok = take_for_this_process(fd, settings.path); !ok) return pass(ok);
  if (auto ok = set_up(fd, settings); !ok) return pass(ok);
  return line;
}

SerialLine::~SerialLine() {
  ::close(fd_);
}

tl::unexpected<base::Error> SerialLine::lost(const std::string& why) const {
  return fail(ErrorCode::lost, "the serial line is gone: " + why, settings_.path);
}

Result<void> SerialLine::write(std::string_view bytes, milliseconds within) {
  const auto deadline = Steady::now() + within;
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
      continue;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) return lost(std::strerror(errno));
    pollfd wait{fd_, POLLOUT, 0};
    const int ready = ::poll(&wait, 1, time_left_ms(deadline));
    if (ready > 0 && (wait.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return lost("hung up");
    if (ready == 0) {
      return fail(ErrorCode::timeout, fmt::format("the line takes no bytes within {} ms", within.count()),
                  settings_.path);
    }
  }
  return {};
}

Result<bool> SerialLine::take_in(Steady::time_point deadline) {
  bool hung_up = false;
  while (true) {
    std::array<char, 1024> buffer{};
    const ssize_t n = ::read(fd_, buffer.data(), buffer.size());
    if (n > 0) {
      come_.append(buffer.data(), static_cast<std::size_t>(n));
      return true;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) return lost(std::strerror(errno));
    // A line that hung up is readable for ever; what came before it did is read first.
    if (hung_up) return lost("hung up");
    pollfd wait{fd_, POLLIN, 0};
    const int ready = ::poll(&wait, 1, time_left_ms(deadline));
    if (ready == 0) return false;
    hung_up = ready > 0 && (wait.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  }
}

Result<std::string> SerialLine::read_until(char end, milliseconds within, std::size_t most) {
  const auto deadline = Steady::now() + within;
  while (true) {
    const auto found = come_.find(end);
    if (found != std::string::npos && found <= most) {
      std::string text = come_.substr(0, found);
      come_.erase(0, found + 1);
      return text;
    }
    if (come_.size() > most) {
      come_.clear();
      return fail(ErrorCode::damaged, fmt::format("{} bytes and no end of the answer", most), settings_.path);
    }
    auto more = take_in(deadline);
    if (!more) return pass(more);
    if (!*more) {
      return fail(ErrorCode::timeout, fmt::format("no answer within {} ms", within.count()), settings_.path);
    }
  }
}

Result<std::string> SerialLine::read_exactly(std::size_t count, milliseconds within) {
  const auto deadline = Steady::now() + within;
  while (come_.size() < count) {
    auto more = take_in(deadline);
    if (!more) return pass(more);
    if (!*more) {
      return fail(ErrorCode::timeout,
                  fmt::format("{} of {} bytes within {} ms", come_.size(), count, within.count()),
                  settings_.path);
    }
  }
  std::string bytes = come_.substr(0, count);
  come_.erase(0, count);
  return bytes;
}

Result<std::string> SerialLine::read_some(Steady::time_point deadline) {
  if (come_.empty()) {
    auto more = take_in(deadline);
    if (!more) return pass(more);
  }
  return std::exchange(come_, {});
}

Result<std::string> SerialLine::read_waiting() {
  constexpr std::size_t kMost = 100'000;
  while (come_.size() < kMost) {
    auto more = take_in(Steady::now());
    if (!more) return pass(more);
    if (!*more) break;
  }
  return std::exchange(come_, {});
}

void SerialLine::discard_input() {
  come_.clear();
  ::tcflush(fd_, TCIFLUSH);
}

}  // namespace rig::drivers
