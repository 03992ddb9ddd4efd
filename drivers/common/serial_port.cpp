#include "drivers/common/serial_port.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <sys/file.h>
#include <termios.h>

namespace rig::drivers {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

struct Speed {
  int baud;
  speed_t code;
};
constexpr std::array kSpeeds{
    Speed{1200, B1200},     Speed{2400, B2400},     Speed{4800, B4800},     Speed{9600, B9600},
    Speed{19200, B19200},   Speed{38400, B38400},   Speed{57600, B57600},   Speed{115200, B115200},
    Speed{230400, B230400}, Speed{460800, B460800}, Speed{921600, B921600},
};

const Speed* speed_of(int baud) {
  for (const Speed& speed : kSpeeds) {
    if (speed.baud == baud) return &speed;
  }
  return nullptr;
}

}  // namespace

Result<void> take_for_this_process(int fd, const std::string& path) {
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0) return {};
  return fail(ErrorCode::busy, "another program has the serial line", path);
}

bool is_serial_speed(int baud) {
  return speed_of(baud) != nullptr;
}

Result<void> check_speed(int fd, int baud, const std::string& path) {
  termios is{};
  if (::tcgetattr(fd, &is) != 0) {
    return fail(ErrorCode::io, fmt::format("this is no serial line: {}", std::strerror(errno)), path);
  }
  const Speed* speed = speed_of(baud);
  if (speed != nullptr && ::cfgetospeed(&is) == speed->code) return {};
  return fail(ErrorCode::bad_input, fmt::format("the line does not run at {} baud", baud), path);
}

}  // namespace rig::drivers
