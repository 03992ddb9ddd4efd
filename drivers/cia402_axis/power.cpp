#include "drivers/cia402_axis/power.h"

#include <algorithm>
#include <poll.h>

namespace rig::drivers::cia402 {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;

namespace {

// Within these a drive answers an order by its statusword: a few of its cycles, and what a busy bus adds.
constexpr milliseconds kBitWithin{200}, kResetWithin{300};
// A drive that does not lead back from its quick stop leads there over switch on disabled.
constexpr milliseconds kBackWithin{150};
// Is left for the last look of a call that waited in vain.
constexpr milliseconds kLastLook{20};

void pause() {
  (void)::poll(nullptr, 0, 1);
}

tl::unexpected<base::Error> fault_error(const Drive& drive, std::uint16_t code) {
  return fail(ErrorCode::device,
              fmt::format("the drive is in a fault: {} (0x{:04X})", text_of_error_code(code), code),
              drive.where(), "remove its cause, then clear the stop");
}

Result<bool> await_bit(Drive& drive, std::uint16_t bit, bool wanted, Deadline deadline) {
  const auto end = std::min(deadline, Steady::now() + kBitWithin);
  while (true) {
    const auto statusword = drive.statusword(deadline);
    if (!statusword) return pass(statusword);
    if (((*statusword & bit) != 0) == wanted) return true;
    if (Steady::now() >= end) return false;
    pause();
  }
}

}  // namespace

Result<void> reset_fault(Drive& drive, Deadline deadline) {
  // It is the edge that resets.
  for (const std::uint16_t controlword : {control::kDisableVoltage, control::kFaultReset}) {
    if (auto ordered = drive.control(controlword, deadline); !ordered) return ordered;
  }
  const auto end = std::min(deadline, Steady::now() + kResetWithin);
  while (true) {
    const auto statusword = drive.statusword(deadline);
    if (!statusword) return pass(statusword);
    if (power_of(*statusword) != Power::fault) break;
    if (Steady::now() >= end) {
      const auto code = drive.read<std::uint16_t>(object::kErrorCode, deadline);
      return fault_error(drive, code ? *code : std::uint16_t{0});
    }
    pause();
  }
  return drive.control(control::kDisableVoltage, deadline);
}

// One transition at a time: the next is ordered when the drive shows that the one before is done.
Result<void> reach_operation(Drive& drive, Deadline deadline) {
  std::optional<Power> ordered_in;
  Steady::time_point ordered_at{};
  while (true) {
    const auto statusword = drive.statusword(deadline);
    if (!statusword) return pass(statusword);
    const Power power = power_of(*statusword);
    if (power == Power::operation_enabled) return {};
    if (power == Power::fault) {
      const auto code = drive.read<std::uint16_t>(object::kErrorCode, deadline);
      return fault_error(drive, code ? *code : std::uint16_t{0});
    }
    if (ordered_in != power) {
      if (const auto order = towards_operation(power, drive.stays_in_quick_stop())) {
        if (auto done = drive.control(*order, deadline); !done) return done;
      }
      ordered_in = power;
      ordered_at = Steady::now();
    } else if (power == Power::quick_stop && drive.stays_in_quick_stop() &&
               (*statusword & status::kTargetReached) != 0 && Steady::now() - ordered_at > kBackWithin) {
      // The way straight back is not every drive's.
      if (auto done = drive.control(control::kDisableVoltage, deadline); !done) return done;
      ordered_at = Steady::now();
    }
    if (Steady::now() + kLastLook >= deadline) {
      const bool remote = (*statusword & status::kRemote) != 0;
      return fail(ErrorCode::device, fmt::format("the drive stays in '{}'", text_of(power)), drive.where(),
                  remote ? "has it its motor supply, and is its enable input closed?"
                         : "it is not in remote mode (bit 9 of its statusword): it takes no orders over CAN");
    }
    pause();
  }
}

Result<void> require_operation(Drive& drive, Deadline deadline) {
  const auto statusword = drive.statusword(deadline);
  if (!statusword) return pass(statusword);
  switch (power_of(*statusword)) {
    case Power::operation_enabled:
      return {};
    case Power::quick_stop:
      return reach_operation(drive, deadline);
    case Power::fault:
    case Power::fault_reaction: {
      const auto code = drive.read<std::uint16_t>(object::kErrorCode, deadline);
      return fault_error(drive, code ? *code : std::uint16_t{0});
    }
    default:
      return fail(ErrorCode::refused,
                  fmt::format("the drive is not enabled: '{}'", text_of(power_of(*statusword))),
                  drive.where(), "enable it first");
  }
}

Result<void> let_motor_go(Drive& drive, Deadline deadline) {
  if (auto ordered = drive.control(control::kDisableVoltage, deadline); !ordered) return ordered;
  Power power{};
  do {
    const auto statusword = drive.statusword(deadline);
    if (!statusword) return pass(statusword);
    power = power_of(*statusword);
    if (!is_energised(power)) return {};
    pause();
  } while (Steady::now() + kBitWithin < deadline);
  return fail(ErrorCode::device, fmt::format("the drive does not let its motor go: '{}'", text_of(power)),
              drive.where());
}

Result<void> require_mode(Drive& drive, std::int8_t mode, Deadline deadline) {
  const auto shows = drive.set_mode(mode, deadline);
  if (!shows) return pass(shows);
  if (*shows) return {};
  return fail(ErrorCode::device,
              fmt::format("the drive does not go to {} mode; it shows mode {}",
                          mode == kHoming ? "homing" : "profile position", drive.mode()),
              drive.where());
}

// The drive takes the set-point at the edge of bit 4 and says so with bit 12, which it takes back when bit 4
// is.
Result<void> hand_over_set_point(Drive& drive, Deadline deadline) {
  constexpr std::uint16_t kReady = control::kEnableOperation | control::kChangeAtOnce;
  if (auto done = drive.control(kReady, deadline); !done) return done;
  const auto free = await_bit(drive, status::kSetPointTaken, false, deadline);
  if (!free) return pass(free);
  if (!*free) {
    return fail(ErrorCode::device, "the drive takes no set-point: it still holds the one before (bit 12)",
                drive.where());
  }
  if (auto done = drive.control(kReady | control::kNewSetPoint, deadline); !done) return done;
  const auto taken = await_bit(drive, status::kSetPointTaken, true, deadline);
  // Whatever it said: with the bit left set, a later order would lack its edge.
  if (auto done = drive.control(kReady, deadline); !done) return done;
  if (!taken) return pass(taken);
  if (!*taken) {
    return fail(ErrorCode::device, "the drive did not take the set-point (bit 12)", drive.where(),
                "is it beyond the drive's own software limits?");
  }
  return {};
}

}  // namespace rig::drivers::cia402
