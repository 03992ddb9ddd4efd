#include "sim/wire/canopen_console.h"

#include <fmt/format.h>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace rig::sim::wire {

namespace {

unsigned long number(const std::string& text, unsigned long most) {
  std::size_t used = 0;
  const unsigned long value = std::stoul(text, &used, 0);
  if (used != text.size() || value > most) throw std::invalid_argument("'" + text + "' is no such number");
  return value;
}

bool on_or_off(const std::string& text) {
  if (text != "on" && text != "off") throw std::invalid_argument("'" + text + "' is neither on nor off");
  return text == "on";
}

std::string carry_out(CanopenStation& station, const std::vector<std::string>& words) {
  const auto word = [&](std::size_t i) -> const std::string& {
    if (i >= words.size()) throw std::invalid_argument("a word is missing");
    return words[i];
  };
  const std::string& order = word(0);
  if (order == "unplug") {
    station.unplug(on_or_off(word(1)));
    return "ok";
  }
  const int id = static_cast<int>(number(word(1), 127));
  if (order == "power" && word(2) == "cycle") {
    station.power_cycle(id);
    return "ok";
  }
  return station.with(id, [&](CanopenNode& node, CanopenNode::Time now) -> std::string {
    if (order == "limit") {
      const bool high = word(2) == "high";
      if (!high && word(2) != "low") throw std::invalid_argument("a limit is low or high");
      node.drive().press_limit(high, on_or_off(word(3)));
    } else if (order == "fault" && word(2) == "gone") {
      node.drive().cause_gone();
    } else if (order == "fault") {
      node.drive().trip(static_cast<std::uint16_t>(number(word(2), 0xFFFF)), 0x01);
    } else if (order == "emcy") {
      node.emergency(static_cast<std::uint16_t>(number(word(2), 0xFFFF)),
                     static_cast<std::uint8_t>(number(word(3), 0xFF)));
    } else if (order == "following") {
      node.drive().set_following_error(on_or_off(word(2)));
    } else if (order == "mute") {
      node.mute_heartbeat(on_or_off(word(2)));
    } else if (order == "silence") {
      node.silence_server(on_or_off(word(2)));
    } else if (order == "nmt") {
      node.nmt(now, static_cast<std::uint8_t>(number(word(2), 0xFF)));
    } else if (order == "power") {
      on_or_off(word(2)) ? node.power_on(now) : node.power_off(now);
    } else if (order == "show") {
      return fmt::format("node {} position {:.1f} {} statusword 0x{:04X} nmt {} stops {}", id,
                         node.drive().position(), node.drive().moving() ? "moving" : "standing",
                         node.drive().statusword(), node.nmt_state(), node.drive().stops_seen());
    } else {
      throw std::invalid_argument("no such order: '" + order + "'");
    }
    return "ok";
  });
}

}  // namespace

const char* canopen_orders() {
  return R"(limit NODE low|high on|off   press a limit switch
fault NODE CODE | gone       a fault, which lasts until its cause is gone
emcy NODE CODE REGISTER      an emergency object (code 0: the errors are gone)
following NODE on|off        the following error bit
mute NODE on|off             no heartbeats
silence NODE on|off          no SDO answers
nmt NODE COMMAND             as an NMT master (1 start, 2 stop, 128 pre-operational, 129 reset)
power NODE on|off|cycle
unplug on|off                the cable of all nodes
show NODE
)";
}

std::string obey(CanopenStation& station, std::string_view line) {
  std::istringstream stream{std::string(line)};
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (words.empty()) return "ok";
  try {
    return carry_out(station, words);
  } catch (const std::exception& error) {
    return fmt::format("error: {}", error.what());
  }
}

}  // namespace rig::sim::wire
