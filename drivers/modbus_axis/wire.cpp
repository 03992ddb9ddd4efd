#include "drivers/modbus_axis/wire.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <modbus.h>
#include <poll.h>
#include <sys/select.h>
#include <thread>
#include <unistd.h>

#include "drivers/common/serial_port.h"

namespace rig::drivers::modbus {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

// How long a line may go on chattering before a request before that is an error.
constexpr milliseconds kMostNoise{500};
// And before a request that does not wait for it to end: how many times the silence that it should have.
constexpr int kGapsAtOnce = 4;
constexpr milliseconds kLeastConnecting{500};
// A server that does not send small segments at once holds one back until the last is acknowledged: 40 ms.
constexpr milliseconds kSlowestSegment{50};

void set_response_timeout(modbus_t* context, milliseconds within) {
  const auto us = std::chrono::duration_cast<microseconds>(within).count();
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(us / 1000000),
                              static_cast<std::uint32_t>(us % 1000000));
}

// At least 1 ms: none at all would be for ever.
milliseconds left_until(Deadline end) {
  return std::max(std::chrono::floor<milliseconds>(end - Steady::now()), milliseconds(1));
}

}  // namespace

std::string WireSettings::where() const {
  return serial.path.empty() ? fmt::format("{}:{}", host, tcp_port) : serial.path;
}

microseconds silent_interval(int baud) {
  constexpr int kFast = 19200;
  if (baud > kFast) return microseconds(1750);
  return microseconds(35 * 11 * 100000 / baud);
}

void Wire::Free::operator()(modbus_t* context) const {
  modbus_close(context);
  modbus_free(context);
}

Wire::~Wire() = default;

Result<std::unique_ptr<Wire>> Wire::open(const WireSettings& settings, Deadline call_ends) {
  const SerialSettings& serial = settings.serial;
  const bool rtu = !serial.path.empty();
  modbus_t* made = rtu ? modbus_new_rtu(serial.path.c_str(), serial.baud, serial.parity, 8, serial.stop_bits)
                       : modbus_new_tcp_pi(settings.host.c_str(), std::to_string(settings.tcp_port).c_str());
  if (made == nullptr) {
    return fail(ErrorCode::bad_input, modbus_strerror(errno), settings.where());
  }
  std::unique_ptr<Wire> wire(new Wire(settings, Context(made)));
  if (auto ok = wire->set_up(call_ends); !ok) return pass(ok);
  return wire;
}

Result<void> Wire::set_up(Deadline call_ends) {
  modbus_t* context = context_.get();
  const bool rtu = !settings_.serial.path.empty();
  modbus_set_error_recovery(context, MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_byte_timeout(context, 0, 0);
  // Connecting is bounded by the same time-out.
  const milliseconds left = std::max(left_until(call_ends), settings_.answer / 2);
  set_response_timeout(context, std::min(std::max(settings_.answer, kLeastConnecting), left));
  if (modbus_connect(context) != 0) {
    const bool forbidden = errno == EACCES;
    return fail(ErrorCode::lost, fmt::format("cannot open it: {}", modbus_strerror(errno)), settings_.where(),
                !rtu        ? "is the drive or the gateway on, and its address right?"
                : forbidden ? "is rigd in the group that owns it (dialout)?"
                            : "is it plugged in?");
  }
  const int fd = modbus_get_socket(context);
  if (fd < 0 || fd >= FD_SETSIZE) {
    return fail(ErrorCode::io, "this process has too many files open", settings_.where());
  }
  quiet_since_ = Steady::now();
  if (!rtu) return {};
  if (auto ok = take_for_this_process(fd, settings_.where()); !ok) return ok;
  return check_speed(fd, settings_.serial.baud, settings_.where());
}

Result<bool> Wire::clear_line(microseconds silence, Deadline give_up) {
  const int fd = modbus_get_socket(context_.get());
  while (true) {
    const auto wait = std::chrono::ceil<milliseconds>(quiet_since_ + silence - Steady::now());
    pollfd input{fd, POLLIN, 0};
    const int ready = ::poll(&input, 1, static_cast<int>(std::max(wait, milliseconds(0)).count()));
    if (ready == 0 || (ready < 0 && errno == EINTR)) {
      if (Steady::now() >= quiet_since_ + silence) return true;
      continue;
    }
    std::array<char, 512> dropped{};
    const ssize_t n = ready > 0 ? ::read(fd, dropped.data(), dropped.size()) : -1;
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
      return fail(ErrorCode::lost,
                  fmt::format("the line is gone: {}", n == 0 ? "hung up" : std::strerror(errno)),
                  settings_.where());
    }
    quiet_since_ = Steady::now();
    if (quiet_since_ >= give_up) return false;
  }
}

Result<void> Wire::prepare(Deadline call_ends) {
  const auto clear = clear_line(silence_, std::min(call_ends, Steady::now() + kMostNoise));
  if (!clear) return pass(clear);
  if (!*clear) {
    return fail(ErrorCode::damaged, "the line is never silent", settings_.where(),
                "does another master speak on it, is it terminated and biased?");
  }
  silence_ = settings_.gap;
  if (Steady::now() >= call_ends) {
    return fail(ErrorCode::timeout, "the call was over before it could be asked", settings_.where());
  }
  wait_for_answer(call_ends);
  return {};
}

void Wire::wait_for_answer(Deadline call_ends) {
  within_ = std::min(settings_.answer, left_until(call_ends));
  set_response_timeout(context_.get(), within_);
}

tl::unexpected<base::Error> Wire::failed(int code, int slave, const std::string& doing) {
  quiet_since_ = Steady::now();
  const std::string where = fmt::format("{}, slave {}", settings_.where(), slave);
  const std::string what = fmt::format("{}: {}", doing, modbus_strerror(code));
  switch (code) {
    case ETIMEDOUT:
    case EAGAIN:
    case EMBXGPATH:
    case EMBXGTAR:
      return fail(ErrorCode::timeout, fmt::format("{}: no answer within {} ms", doing, within_.count()),
                  where);
    // Leadshine's drives answer a request whose checksum is wrong with the exception that is "memory parity"
    // in the protocol's list.
    case EMBXMEMPAR:
    case EMBXSBUSY:
    case EMBXACK:
    case EMBBADCRC:
    case EMBBADDATA:
    case EMBBADEXC:
    case EMBUNKEXC:
    case EMBMDATA:
    case EMBBADSLAVE:
      silence_ = std::max<microseconds>(settings_.answer / 2, kSlowestSegment);
      return fail(ErrorCode::damaged, what, where);
    case EMBXILFUN:
    case EMBXILADD:
    case EMBXILVAL:
    case EMBXSFAIL:
    case EMBXNACK:
      return fail(ErrorCode::device, "the drive refuses " + what, where,
                  "does the profile fit this drive, and do the settings fit its ranges?");
    default:
      return fail(ErrorCode::lost, what, settings_.where());
  }
}

Result<std::vector<std::uint16_t>> Wire::read(int slave, const Block& block, Deadline call_ends) {
  if (auto ready = prepare(call_ends); !ready) return pass(ready);
  modbus_t* context = context_.get();
  modbus_set_slave(context, slave);
  std::vector<std::uint16_t> words(block.count);
  const auto ask = block.table == Table::input ? modbus_read_input_registers : modbus_read_registers;
  if (ask(context, block.address, block.count, words.data()) != block.count) {
    return failed(errno, slave, fmt::format("to read {} from 0x{:04X}", block.count, block.address));
  }
  quiet_since_ = Steady::now();
  return words;
}

Result<void> Wire::write(int slave, const Write& write, bool single, Deadline call_ends) {
  if (auto ready = prepare(call_ends); !ready) return ready;
  return send(slave, write, single);
}

Result<void> Wire::write_at_once(int slave, const Write& write, bool single, Deadline call_ends) {
  const auto clear = clear_line(settings_.gap, Steady::now() + kGapsAtOnce * settings_.gap);
  if (!clear) return pass(clear);
  silence_ = settings_.gap;
  wait_for_answer(call_ends);
  return send(slave, write, single);
}

Result<void> Wire::send(int slave, const Write& write, bool single) {
  modbus_t* context = context_.get();
  modbus_set_slave(context, slave);
  const int count = static_cast<int>(write.words.size());
  const int written = single && count == 1
                          ? modbus_write_register(context, write.address, write.words[0])
                          : modbus_write_registers(context, write.address, count, write.words.data());
  if (written != count) {
    return failed(errno, slave, fmt::format("to write {} from 0x{:04X}", count, write.address));
  }
  quiet_since_ = Steady::now();
  return {};
}

}  // namespace rig::drivers::modbus
