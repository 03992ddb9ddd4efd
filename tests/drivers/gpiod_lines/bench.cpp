#include "tests/drivers/gpiod_lines/bench.h"

#include "drivers/conformance/module_under_test.h"
#include "drivers/host/module_loader.h"

namespace rig::drivers::gpiod_lines {

namespace {

void log_nothing(base::LogLevel /*level*/, std::string_view /*message*/) {}

}  // namespace

std::string settings_for(const std::filesystem::path& socket, const std::string& more) {
  return fmt::format(R"(
chip = "unix:{}"
{}
[input.emergency_stop]
offset = 0
[input.limit]
line = "LIMIT"
active = "low"
debounce_ms = 5
[output.lamp]
offset = 2
[output.shutter]
offset = 3
active = "low"
[output.trigger]
offset = 4
pulse_us = 2000
[output.spare]
line = "SPARE"
[light]
relay = "lamp"
shutter = "shutter"
)",
                     socket.string(), more);
}

LinesBench::LinesBench() : board_(folder_ / "board", {"ESTOP", "LIMIT", "LAMP", "", "TRIGGER", "SPARE"}) {
  const auto entry = load_module("gpiod_lines", {RIG_BINARY_DIR "/lib"});
  EXPECT_TRUE(entry) << entry.error().text();
  module_ = entry.value();
  reset();
}

base::Result<std::vector<Device>> LinesBench::open() {
  return open_with(settings_for(board_.path()));
}

base::Result<std::unique_ptr<conformance::Victim>> LinesBench::start_victim(const conformance::Task& task) {
  return conformance::start_victim({"gpiod_lines", settings_for(board_.path()), folder_.path()}, task);
}

base::Result<std::vector<Device>> LinesBench::open_with(const std::string& settings) {
  const auto table = base::ConfigTable::parse(settings, "rig.toml");
  if (!table) return base::pass(table);
  return module_->open({"lines", *table, folder_.path(), *clock_, &log_nothing});
}

void LinesBench::reset() {
  board_.spoil(sim::wire::LineBoard::Spoil::missing, 0);
  board_.cut();
  for (unsigned int line = 0; line <= kSpare; ++line) board_.drive(line, std::nullopt);
  board_.drive(kEmergencyStop, false);  // its contact is closed, to ground
  board_.drive(kLimit, true);
  board_.restore();
}

std::optional<conformance::LightUnderTest> LinesBench::light() {
  return conformance::LightUnderTest{"light", this};
}

std::optional<conformance::LinesUnderTest> LinesBench::lines() {
  conformance::LinesUnderTest lines;
  lines.device = "lines";
  lines.peer = this;
  lines.input = "emergency_stop";
  lines.output = "spare";
  lines.seen_within = std::chrono::milliseconds(50);
  return lines;
}

bool LinesBench::cut() {
  board_.cut();
  return true;
}

bool LinesBench::restore() {
  board_.restore();
  return true;
}

bool LinesBench::spoil(conformance::Spoil how, int answers) {
  using sim::wire::LineBoard;
  switch (how) {
    case conformance::Spoil::missing:
      board_.spoil(LineBoard::Spoil::missing, answers);
      return true;
    case conformance::Spoil::garbage:
      board_.spoil(LineBoard::Spoil::garbage, answers);
      return true;
    case conformance::Spoil::late:
      board_.spoil(LineBoard::Spoil::late, answers);
      return true;
    case conformance::Spoil::duplicate:
      board_.spoil(LineBoard::Spoil::duplicate, answers);
      return true;
  }
  return false;
}

bool LinesBench::thin_out(int answers) {
  board_.spoil(sim::wire::LineBoard::Spoil::two_of_three, answers);
  return true;
}

void LinesBench::set_input(const std::string& line, bool active) {
  if (line == "emergency_stop") board_.drive(kEmergencyStop, active ? std::nullopt : std::optional(false));
  if (line == "limit") board_.drive(kLimit, !active);
}

// An input of the board has no bias of its own: what nobody drives is inactive.
bool LinesBench::output(const std::string& line) {
  if (line == "lamp") return board_.is_output(kLamp) && board_.high(kLamp);
  if (line == "shutter") return board_.is_output(kShutter) && !board_.high(kShutter);
  return board_.is_output(kSpare) && board_.high(kSpare);
}

double LinesBench::level() {
  return output("lamp") && output("shutter") ? 1 : 0;
}

}  // namespace rig::drivers::gpiod_lines
