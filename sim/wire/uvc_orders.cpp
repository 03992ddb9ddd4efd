#include "sim/wire/uvc_orders.h"

#include <charconv>
#include <functional>
#include <map>
#include <sstream>
#include <vector>

namespace rig::sim::wire {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

struct Order {
  std::size_t numbers;
  std::function<void(UvcCamera&, const std::vector<int>&)> carry_out;
};

const std::map<std::string, Order, std::less<>>& orders() {
  using Numbers = std::vector<int>;
  static const std::map<std::string, Order, std::less<>> all{
      {"light", {1, [](UvcCamera& c, const Numbers& n) { c.set_light(static_cast<std::uint32_t>(n[0])); }}},
      {"delay", {1, [](UvcCamera& c, const Numbers& n) { c.set_settings_delay(n[0]); }}},
      {"damage", {1, [](UvcCamera& c, const Numbers& n) { c.damage_frames(n[0]); }}},
      {"drop", {1, [](UvcCamera& c, const Numbers& n) { c.drop_frames(n[0]); }}},
      {"cut", {2, [](UvcCamera& c, const Numbers& n) { c.cut_frames(n[0], n[1]); }}},
      {"stall",
       {2,
        [](UvcCamera& c, const Numbers& n) { c.stall_requests(n[0], static_cast<UvcError>(n[1] & 0xFF)); }}},
      {"ignore", {1, [](UvcCamera& c, const Numbers& n) { c.ignore_requests(n[0]); }}},
      {"slow", {1, [](UvcCamera& c, const Numbers& n) { c.answer_slowly(std::chrono::milliseconds(n[0])); }}},
  };
  return all;
}

std::string state_of(UvcCamera& camera) {
  const UvcState s = camera.state();
  return fmt::format(
      "streaming {} format {} frame_size {} interval {} automatic {} exposure {} gain {} brightness {} frame "
      "{} "
      "sent {} overrun {} commits {} stops {} exposures_set {} stalled {}",
      s.streaming ? 1 : 0, s.choice.format, s.choice.frame, s.choice.interval, s.automatic ? 1 : 0,
      s.settings.exposure_100us, s.settings.gain, s.settings.brightness, s.frame, s.sent, s.overrun,
      s.commits, s.stops, s.exposures_set, s.stalled);
}

bool read_number(const std::string& word, int& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size() && value >= 0;
}

}  // namespace

Result<std::string> carry_out_order(UvcCamera& camera, std::string_view line) {
  std::istringstream in{std::string(line)};
  std::string what;
  if (!(in >> what)) return std::string();
  std::vector<int> numbers;
  bool good = true;
  for (std::string word; in >> word;) {
    numbers.push_back(0);
    good = good && read_number(word, numbers.back());
  }
  if (what == "state" && numbers.empty()) return state_of(camera);
  const auto found = orders().find(what);
  if (!good || found == orders().end() || numbers.size() != found->second.numbers) {
    return fail(ErrorCode::bad_input, fmt::format("not understood: '{}'", line));
  }
  found->second.carry_out(camera, numbers);
  return std::string();
}

}  // namespace rig::sim::wire
