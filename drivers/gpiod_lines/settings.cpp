#include "drivers/gpiod_lines/settings.h"

#include <algorithm>

namespace rig::drivers::gpiod_lines {

namespace {

constexpr std::int64_t kMostLines = 1024;
constexpr std::int64_t kLongestPulse_us = 20'000;  // a call of rigd waits for it
constexpr double kLongestDebounce_ms = 1000;
constexpr std::int64_t kSlowestPoll_ms = 1000;
constexpr double kNsPerMs = 1e6;
constexpr std::int64_t kNsPerUs = 1000;

Rest read_rest(const base::ConfigTable& table, const char* key) {
  const std::string rest = table.choice_or(key, "inactive", {"inactive", "active", "keep"});
  return rest == "active" ? Rest::active : rest == "keep" ? Rest::keep : Rest::inactive;
}

// Where on the chip.
LineRequest read_place(const std::string& name, const base::ConfigTable& table) {
  LineRequest request;
  request.name = name;
  if (table.has("offset") == table.has("line")) {
    table.error(
        "", table.has("line") ? "both offset and line say which line it is" : "nothing says which line it is",
        "offset = 3, or line = \"GPIO3\"");
  }
  if (table.has("offset"))
    request.offset = static_cast<unsigned int>(table.integer("offset", 0, kMostLines - 1));
  if (table.has("line")) {
    request.label = table.text("line");
    if (request.label.empty() || request.label.find_first_of(" \n") != std::string::npos) {
      table.error("line", "a line's name is not empty and has no spaces");
    }
  }
  request.active_low = table.choice_or("active", "high", {"high", "low"}) == "low";
  return request;
}

LineSettings read_input(const std::string& name, const base::ConfigTable& table) {
  LineSettings line;
  line.request = read_place(name, table);
  const std::string bias = table.choice_or("bias", "pull-up", {"pull-up", "pull-down", "none", "as-is"});
  if (bias == "as-is") line.request.bias = Bias::as_is;
  if (bias == "none") line.request.bias = Bias::none;
  if (bias == "pull-down") line.request.bias = Bias::pull_down;
  line.request.edges = table.choice_or("edges", "told", {"told", "polled"}) == "told";
  line.debounce_ns =
      static_cast<std::int64_t>(table.number_or("debounce_ms", 0, {0, kLongestDebounce_ms}) * kNsPerMs);
  return line;
}

LineSettings read_output(const std::string& name, const base::ConfigTable& table) {
  LineSettings line;
  line.request = read_place(name, table);
  line.request.output = true;
  const std::string drive = table.choice_or("drive", "push-pull", {"push-pull", "open-drain", "open-source"});
  if (drive == "open-drain") line.request.drive = Drive::open_drain;
  if (drive == "open-source") line.request.drive = Drive::open_source;
  line.request.at_start = read_rest(table, "at_start");
  line.at_exit = read_rest(table, "at_exit");
  // Others may hold a line that is driven to one side only.
  line.verify = table.boolean_or("verify", line.request.drive == Drive::push_pull);
  if (table.has("pulse_us")) line.pulse_ns = table.integer("pulse_us", 1, kLongestPulse_us) * kNsPerUs;
  if (line.pulse_ns > 0 && (line.request.at_start != Rest::inactive || line.at_exit != Rest::inactive)) {
    table.error("pulse_us", "an output that falls back by itself rests inactive",
                "leave out at_start and at_exit");
  }
  return line;
}

void check_distinct(const base::ConfigTable& settings, const std::vector<LineSettings>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const LineRequest& a = lines[k].request;
      const LineRequest& b = lines[i].request;
      if (a.name == b.name) settings.error("", fmt::format("'{}' is an input and an output", a.name));
      if ((a.offset && a.offset == b.offset) || (!a.label.empty() && a.label == b.label)) {
        settings.error("", fmt::format("'{}' and '{}' are the same line of the chip", a.name, b.name));
      }
    }
  }
}

}  // namespace

LinesSettings read_lines_settings(const base::ConfigTable& settings) {
  LinesSettings all;
  all.chip = settings.text("chip");
  if (settings.has("chip") && all.chip.empty()) {
    settings.error("chip", "names no chip of lines", "gpiodetect lists them");
  }
  all.poll = std::chrono::milliseconds(settings.integer_or("poll_ms", all.poll.count(), 1, kSlowestPoll_ms));
  for (const bool output : {false, true}) {
    const auto table = settings.table_if(output ? "output" : "input");
    if (!table) continue;
    for (const std::string& name : table->keys()) {
      all.lines.push_back(output ? read_output(name, table->table(name))
                                 : read_input(name, table->table(name)));
    }
  }
  if (all.lines.empty()) {
    settings.error("", "the module is given no line",
                   "add a table [module.settings.input.NAME] or .output.NAME");
  }
  check_distinct(settings, all.lines);
  if (const auto light = settings.table_if("light")) {
    all.light = read_relay_light_settings(*light, lines_of(all));
    for (const LineSettings& line : all.lines) {
      const bool used = line.request.name == all.light->relay || line.request.name == all.light->shutter;
      if (used && line.pulse_ns > 0) {
        light->error("", fmt::format("'{}' falls back by itself and holds no light", line.request.name),
                     "take pulse_us from it");
      }
    }
  }
  return all;
}

std::vector<Line> lines_of(const LinesSettings& settings) {
  std::vector<Line> lines;
  lines.reserve(settings.lines.size());
  for (const LineSettings& line : settings.lines) {
    Line& told = lines.emplace_back();
    told.name = line.request.name;
    told.output = line.request.output;
    if (told.output && line.at_exit != Rest::keep) told.at_rest = line.at_exit == Rest::active;
  }
  return lines;
}

}  // namespace rig::drivers::gpiod_lines
