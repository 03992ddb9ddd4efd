#include "sim/wire/tic_orders.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>
#include <vector>

namespace rig::sim::wire {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

std::optional<long> number(std::string_view text) {
  const bool hexadecimal = text.starts_with("0x");
  if (hexadecimal) text.remove_prefix(2);
  long value = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, hexadecimal ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<bool> on_or_off(const std::string& word) {
  if (word == "on") return true;
  if (word == "off") return false;
  return std::nullopt;
}

std::string state_of(Tic& tic) {
  return fmt::format(
      "position {} velocity {:.1f} uncertain {} energized {} errors 0x{:04X} stops {} feeds {}",
      tic.position(), tic.velocity(), tic.position_uncertain() ? 1 : 0, tic.energized() ? 1 : 0,
      tic.error_status(), tic.stops_seen(), tic.feeds_seen());
}

}  // namespace

Result<std::string> carry_out_order(Tic& tic, std::string_view line) {
  std::istringstream in{std::string(line)};
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  const auto wrong = [&] { return fail(ErrorCode::bad_input, fmt::format("not understood: '{}'", line)); };
  if (words.empty()) return std::string();
  const std::string& what = words.front();
  if (words.size() == 1) {
    if (what == "state") return state_of(tic);
    if (what != "power_cycle") return wrong();
    tic.power_cycle();
    return std::string();
  }
  if (words.size() == 3) {
    const auto on = on_or_off(words[2]);
    const bool forward = words[1] == "forward";
    if (what != "limit" || !on || (!forward && words[1] != "reverse")) return wrong();
    tic.press_limit(forward, *on);
    return std::string();
  }
  if (words.size() != 2) return wrong();
  if (what == "vin" || what == "put") {
    const auto value = number(words[1]);
    if (!value) return wrong();
    if (what == "vin") {
      tic.set_vin_mv(static_cast<int>(*value));
    } else {
      tic.put_motor(static_cast<double>(*value));
    }
    return std::string();
  }
  const auto on = on_or_off(words[1]);
  if (!on) return wrong();
  if (what == "kill") {
    tic.press_kill_switch(*on);
  } else if (what == "driver_error") {
    tic.set_driver_error(*on);
  } else if (what == "err_line") {
    tic.set_err_line(*on);
  } else {
    return wrong();
  }
  return std::string();
}

Result<void> change_setting(TicSettingBytes& settings, std::string_view text) {
  const auto equals = std::min(text.find('='), text.size());
  const long offset = number(text.substr(0, equals)).value_or(-1);
  const long value = number(text.substr(std::min(equals + 1, text.size()))).value_or(-1);
  constexpr long kMostByte = 255;
  if (offset < 0 || offset >= static_cast<long>(kTicSettings) || value < 0 || value > kMostByte) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' is no setting", text), {},
                "offset and byte, as in 0x41=3");
  }
  settings[static_cast<std::size_t>(offset)] = static_cast<std::uint8_t>(value);
  return {};
}

}  // namespace rig::sim::wire
