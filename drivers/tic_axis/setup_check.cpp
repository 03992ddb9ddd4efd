#include "drivers/tic_axis/setup_check.h"

#include <thread>

#include "drivers/tic_axis/products.h"

namespace rig::drivers::tic {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// What the driver needs of any Tic, whatever rig.toml says.
void compare_needs(const Settings& is, std::vector<Mismatch>& found) {
  if (is.control_mode != 0) {
    found.push_back({"it does not obey over USB (control_mode)", "control_mode: serial"});
  }
  if (is.command_timeout_ms == 0) {
    found.push_back({"it has no command timeout: it would not stop when rigd dies", "command_timeout: 1000"});
  }
  if (is.disable_safe_start) {
    found.push_back(
        {"safe start is off: after an error it would move on by itself", "disable_safe_start: false"});
  }
  if (is.soft_error_response == SoftErrorResponse::go_to_position) {
    found.push_back({"an error makes it go to a position", "soft_error_response: decel_to_hold"});
  }
  if (is.auto_homing) found.push_back({"it homes by itself when it is switched on", "auto_homing: false"});
}

void compare_step_mode(const TicSettings& wanted, Product product, const Settings& is, const Variables& now,
                       std::vector<Mismatch>& found) {
  const auto code = step_mode_code(product, wanted.step_mode);
  if (!code) {
    found.push_back({fmt::format("a {} has no step mode {}", name_of(product), wanted.step_mode), ""});
    return;
  }
  const int set = microsteps(is.step_mode).value_or(0);
  if (set != wanted.step_mode) {
    Mismatch wrong{fmt::format("step_mode is {} in the Tic, {} in rig.toml", set, wanted.step_mode),
                   fmt::format("step_mode: {}", wanted.step_mode)};
    if (product != Product::v36) wrong.bytes = {{kStepModeOffset, *code}};
    found.push_back(std::move(wrong));
  } else if (microsteps(now.step_mode) != wanted.step_mode) {
    found.push_back({"step_mode is overridden until its next reset: ticcmd --reset", ""});
  }
}

void compare_current(const TicSettings& wanted, Product product, const Settings& is, const Variables& now,
                     std::vector<Mismatch>& found) {
  if (wanted.current_limit_ma > most_current_ma(product)) {
    found.push_back({fmt::format("a {} gives at most {} mA, current_limit_ma is {}", name_of(product),
                                 most_current_ma(product), wanted.current_limit_ma),
                     ""});
    return;
  }
  const std::uint8_t code = current_code(product, wanted.current_limit_ma);
  const int want_ma = current_ma(product, code);
  const int set_ma = current_ma(product, is.current_limit);
  if (set_ma != want_ma) {
    Mismatch wrong{fmt::format("current_limit is {} mA in the Tic, {} mA in rig.toml", set_ma, want_ma),
                   fmt::format("current_limit: {}", want_ma)};
    if (product != Product::v36) wrong.bytes = {{kCurrentLimitOffset, code}};
    found.push_back(std::move(wrong));
  } else if (now.operation == Operation::normal && current_ma(product, now.current_limit) != want_ma) {
    // In other states the limit for the time of an error may be in effect.
    found.push_back({"current_limit is overridden until its next reset: ticcmd --reset", ""});
  }
}

void compare_timeout(const TicSettings& wanted, const Settings& is, std::vector<Mismatch>& found) {
  if (!wanted.command_timeout_ms || is.command_timeout_ms == 0) return;
  const int ms = *wanted.command_timeout_ms;
  if (is.command_timeout_ms == ms) return;
  constexpr int kByte = 256;
  found.push_back(
      {fmt::format("command_timeout is {} ms in the Tic, {} ms in rig.toml", is.command_timeout_ms, ms),
       fmt::format("command_timeout: {}", ms),
       {{kCommandTimeoutOffset, static_cast<std::uint8_t>(ms % kByte)},
        {kCommandTimeoutOffset + 1, static_cast<std::uint8_t>(ms / kByte)}}});
}

void compare_homing(const TicSettings& wanted, const Settings& is, std::vector<Mismatch>& found) {
  if (wanted.homing == Homing::none) return;
  const bool forward =
      wanted.homing == Homing::forward || (wanted.homing == Homing::set_here && wanted.switch_is_forward);
  if ((forward ? is.forward_limit_pins : is.reverse_limit_pins) == 0) {
    const char* which = forward ? "forward" : "reverse";
    found.push_back({fmt::format("no pin of it is a {} limit switch, which homing needs", which),
                     fmt::format("rx_config: limit_switch_{} pullup, or another pin's", which)});
  }
  if (wanted.homing == Homing::set_here) return;
  if (is.homing_speed_towards == 0)
    found.push_back({"it would home at no speed", "homing_speed_towards: 1000000"});
  if (is.homing_speed_away == 0)
    found.push_back({"it would leave the switch at no speed", "homing_speed_away: 500000"});
}

}  // namespace

std::vector<Mismatch> compare_setup(const TicSettings& wanted, const Identity& identity, const Settings& is,
                                    const Variables& now) {
  const auto product = product_of(identity.product);
  if (!product) return {{fmt::format("this driver does not know product {:04x}", identity.product), ""}};
  if (identity.firmware < kLeastFirmware) {
    return {{fmt::format(
                 "its firmware {:x}.{:02x} has no limit switches and no homing: update it to 1.06 or later",
                 identity.firmware >> 8U, identity.firmware & 0xFFU),
             ""}};
  }
  std::vector<Mismatch> found;
  compare_needs(is, found);
  compare_step_mode(wanted, *product, is, now, found);
  compare_current(wanted, *product, is, now, found);
  compare_timeout(wanted, is, found);
  compare_homing(wanted, is, found);
  return found;
}

std::string mismatch_text(const std::vector<Mismatch>& mismatches, const std::string& serial) {
  std::string what, mend;
  for (const Mismatch& each : mismatches) {
    what += (what.empty() ? "" : "; ") + each.what;
    if (!each.mend.empty()) mend += (mend.empty() ? "'" : "', '") + each.mend;
  }
  if (mend.empty()) return what;
  return fmt::format(
      "{}. Mend it: 'ticcmd -d {} --get-settings tic.txt', set {}' in that file, 'ticcmd -d {} --settings "
      "tic.txt'",
      what, serial, mend, serial);
}

Result<bool> write_mismatches(Link& link, const std::vector<Mismatch>& mismatches, const Variables& now) {
  bool any = false;
  for (const Mismatch& each : mismatches) any = any || !each.bytes.empty();
  if (!any) return false;
  if (now.velocity != 0 || now.homing) {
    return fail(ErrorCode::busy, "its settings are not written while the motor turns", link.identity().where);
  }
  for (const Mismatch& each : mismatches) {
    for (const auto& [offset, value] : each.bytes) {
      if (auto ok = link.set_setting(offset, value); !ok) return pass(ok);
    }
  }
  if (auto ok = link.quick(Command::reinitialize); !ok) return pass(ok);
  // The guide asks for a pause after a reset before anything else is said.
  constexpr std::chrono::milliseconds kPause{20};
  std::this_thread::sleep_for(kPause);
  return true;
}

}  // namespace rig::drivers::tic
