#include "tests/drivers/dmx_light/bench.h"

#include "drivers/conformance/module_under_test.h"
#include "drivers/host/module_loader.h"

namespace rig::drivers::dmx_light {

namespace {

// Three answers that are missing are not yet a loss, after which the light would be at its level of start.
// And they are waited for so long that a call which finds the widget back, with two of three answers missing,
// would take longer than rigd waits, if call_ms did not end it: 4 questions of 0.7 s.
constexpr const char* kPatient = "attempts = 4\nanswer_ms = 350\ncall_ms = 1400";

void log_it(base::LogLevel /*level*/, std::string_view message) {
  logged().emplace_back(message);
}

}  // namespace

std::vector<std::string>& logged() {
  static std::vector<std::string> lines;
  return lines;
}

DmxBench::DmxBench() : widget_(folder_ / "widget", kSerial) {
  const auto entry = load_module("dmx_light", {RIG_BINARY_DIR "/lib"});
  EXPECT_TRUE(entry) << entry.error().text();
  module_ = entry.value();
}

std::string DmxBench::settings(const std::string& more) const {
  return fmt::format(R"(
port = "{}"
channel = 1
fine_channel = 2
{}
[shutter]
channel = 3
)",
                     (folder_ / "widget").string(), more);
}

base::Result<std::vector<Device>> DmxBench::open() {
  return open_with(settings(kPatient));
}

base::Result<std::unique_ptr<conformance::Victim>> DmxBench::start_victim(const conformance::Task& task) {
  return conformance::start_victim({"dmx_light", settings(kPatient), folder_.path()}, task);
}

base::Result<std::vector<Device>> DmxBench::open_with(const std::string& settings, base::Clock* clock) {
  logged().clear();
  const auto table = base::ConfigTable::parse(settings, "rig.toml");
  if (!table) return base::pass(table);
  return module_->open({"light", *table, folder_.path(), clock == nullptr ? *clock_ : *clock, &log_it});
}

void DmxBench::reset() {
  widget_.restore();
  widget_.power_cycle();
}

std::optional<conformance::LightUnderTest> DmxBench::light() {
  return conformance::LightUnderTest{"light", this};
}

bool DmxBench::cut() {
  widget_.cut();
  return true;
}

bool DmxBench::restore() {
  widget_.restore();
  return true;
}

bool DmxBench::spoil(conformance::Spoil how, int answers) {
  using sim::wire::DmxPro;
  switch (how) {
    case conformance::Spoil::missing:
      widget_.spoil(DmxPro::Spoil::missing, answers);
      return true;
    case conformance::Spoil::garbage:
      widget_.spoil(DmxPro::Spoil::garbage, answers);
      return true;
    case conformance::Spoil::late:
      widget_.spoil(DmxPro::Spoil::late, answers);
      return true;
    case conformance::Spoil::duplicate:
      widget_.spoil(DmxPro::Spoil::duplicate, answers);
      return true;
  }
  return false;
}

bool DmxBench::thin_out(int answers) {
  widget_.spoil(sim::wire::DmxPro::Spoil::two_of_three, answers);
  return true;
}

// A fixture of 16 bits and a shutter that is open at 255 shines so.
double DmxBench::level() {
  const auto output = widget_.output();
  if (output.size() < 3 || output[2] != 255) return 0;
  return (output[0] * 256 + output[1]) / 65535.0;
}

}  // namespace rig::drivers::dmx_light
