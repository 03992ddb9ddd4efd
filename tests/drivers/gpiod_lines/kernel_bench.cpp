#include "tests/drivers/gpiod_lines/kernel_bench.h"

#include <gpiod.h>
#include <thread>

#include "drivers/conformance/module_under_test.h"
#include "drivers/host/module_loader.h"

namespace rig::drivers::gpiod_lines {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLabel = "cp2112_gpio";
constexpr std::chrono::milliseconds kLookEvery{10};

void log_nothing(base::LogLevel /*level*/, std::string_view /*message*/) {}

bool chip_is_there() {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error)) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    gpiod_chip* chip = gpiod_chip_open(entry.path().c_str());
    const bool found = chip != nullptr && std::string(gpiod_chip_label(chip)) == kLabel;
    if (chip != nullptr) gpiod_chip_close(chip);
    if (found) return true;
  }
  return false;
}

}  // namespace

bool has_virtual_usb() {
  return fs::exists(sim::wire::kVhci);
}

KernelBench::KernelBench() {
  const auto entry = load_module("gpiod_lines", {RIG_BINARY_DIR "/lib"});
  EXPECT_TRUE(entry) << entry.error().text();
  module_ = entry.value();
  reset();
}

KernelBench::~KernelBench() {
  unplug();
}

void KernelBench::plug_in() {
  chip_.power_cycle();
  auto plugged = sim::wire::VhciPlug::plug_in(
      [this](const sim::wire::SetupPacket& setup, std::span<const std::uint8_t> out) {
        return chip_.control(setup, out);
      },
      sim::wire::UsbSpeed::full);
  ASSERT_TRUE(plugged) << plugged.error().text();
  plug_ = std::move(*plugged);
  while (!chip_is_there()) std::this_thread::sleep_for(kLookEvery);
}

void KernelBench::unplug() {
  plug_.reset();
  while (chip_is_there()) std::this_thread::sleep_for(kLookEvery);
}

base::Result<std::vector<Device>> KernelBench::open() {
  return open_with(settings());
}

std::string KernelBench::settings(const std::string& emergency_stop) {
  return fmt::format(R"(
chip = "{}"
poll_ms = 50
[input.emergency_stop]
offset = 0
{}
[output.lamp]
offset = 2
[output.shutter]
offset = 3
active = "low"
[output.trigger]
offset = 4
pulse_us = 5000
[output.spare]
offset = 5
[light]
relay = "lamp"
shutter = "shutter"
)",
                     kLabel, emergency_stop);
}

base::Result<std::unique_ptr<conformance::Victim>> KernelBench::start_victim(const conformance::Task& task) {
  return conformance::start_victim({"gpiod_lines", settings(), folder_.path()}, task);
}

base::Result<std::vector<Device>> KernelBench::open_with(const std::string& settings) {
  const auto table = base::ConfigTable::parse(settings, "rig.toml");
  if (!table) return base::pass(table);
  return module_->open({"lines", *table, folder_.path(), *clock_, &log_nothing});
}

void KernelBench::reset() {
  for (unsigned int pin = 0; pin < sim::wire::Cp2112::kPins; ++pin) chip_.drive(pin, std::nullopt);
  chip_.drive(kEmergencyStop, false);  // its contact is closed, to ground
  if (!plug_) plug_in();
}

std::optional<conformance::LightUnderTest> KernelBench::light() {
  return conformance::LightUnderTest{"light", this};
}

std::optional<conformance::LinesUnderTest> KernelBench::lines() {
  conformance::LinesUnderTest lines;
  lines.device = "lines";
  lines.peer = this;
  lines.input = "emergency_stop";
  lines.output = "spare";
  lines.seen_within = std::chrono::seconds(1);  // the machine of the tests may be slow
  return lines;
}

bool KernelBench::cut() {
  unplug();
  return true;
}

bool KernelBench::restore() {
  plug_in();
  return true;
}

void KernelBench::set_input(const std::string& /*line*/, bool active) {
  chip_.drive(kEmergencyStop, active ? std::nullopt : std::optional(false));
}

bool KernelBench::output(const std::string& line) {
  if (line == "lamp") return chip_.is_output(kLamp) && chip_.high(kLamp);
  if (line == "shutter") return chip_.is_output(kShutter) && !chip_.high(kShutter);
  return chip_.is_output(kSpare) && chip_.high(kSpare);
}

double KernelBench::level() {
  return output("lamp") && output("shutter") ? 1 : 0;
}

}  // namespace rig::drivers::gpiod_lines
