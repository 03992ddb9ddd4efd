// The module as a whole: it can be opened and closed for ever.
#include <chrono>

#include "drivers/api/module.h"
#include "drivers/conformance/check_lists.h"
#include "drivers/conformance/ending.h"
#include "drivers/conformance/process_use.h"
#include "drivers/conformance/waiting.h"

namespace rig::drivers::conformance {

namespace {

using Steady = std::chrono::steady_clock;

constexpr int kCycles = 1000;
constexpr bool kSanitized = std::string_view(RIG_DRIVER_SANITIZER) != "none";
// Of the wall: an opening of up to 200 ms reaches the aim. Sanitizers are there for what they find, not for
// the number.
constexpr std::chrono::seconds kBudget{kSanitized ? 10 : 200};
// What is made once and kept (caches, a library's first use) is there after these.
constexpr int kWarmUp = 10;

void open_and_close(Bench& bench, int cycle) {
  auto devices = bench.open();
  if (!devices) fail_check("opening {} of {} failed: {}", cycle, kCycles, told(devices.error()));
  require(!devices->empty(), "opening {} of {} offered no device", cycle, kCycles);
}

// Threads that were told to end may take a moment.
ProcessUse settled_use(Waiting& waiting, const ProcessUse& before) {
  ProcessUse use;
  (void)waiting.until(
      [&] {
        use = process_use();
        return use.threads <= before.threads && use.descriptors <= before.descriptors;
      },
      std::chrono::seconds(2));
  return use;
}

void require_no_growth(const ProcessUse& before, const ProcessUse& after, int cycles) {
  require(after.descriptors <= before.descriptors, "{} file descriptors after {} openings more, {} before",
          after.descriptors, cycles, before.descriptors);
  require(after.threads <= before.threads, "{} threads after {} openings more, {} before", after.threads,
          cycles, before.threads);
  // A hundred bytes an opening are somebody's object; far less is how the heap breathes.
  constexpr std::size_t kBytesEach = 100;
  constexpr std::size_t kBreath = std::size_t{64} * 1024;
  const std::size_t heap_bound = before.heap_bytes + kBreath + kBytesEach * static_cast<std::size_t>(cycles);
  require(after.heap_bytes <= heap_bound, "{} bytes on the heap after {} openings more, {} before",
          after.heap_bytes, cycles, before.heap_bytes);
  if (kSanitized) return;  // it keeps what was freed
  constexpr std::size_t kResident = std::size_t{8} << 20U;
  require(after.resident_bytes <= before.resident_bytes + kResident,
          "{} bytes of resident memory after {} openings more, {} before", after.resident_bytes, cycles,
          before.resident_bytes);
}

Outcome thousand_openings(Bench& bench) {
  Waiting waiting(bench.clock());
  const auto end = Steady::now() + kBudget;
  int cycle = 0;
  while (cycle < kWarmUp) open_and_close(bench, ++cycle);
  const ProcessUse before = process_use();
  while (cycle < kCycles && Steady::now() < end) open_and_close(bench, ++cycle);
  const ProcessUse after = settled_use(waiting, before);
  require_no_growth(before, after, cycle - kWarmUp);
  if (cycle < kCycles)
    not_proven("{} openings in {} s leaked nothing; the aim is {}", cycle, kBudget.count(), kCycles);
  return {};
}

Outcome devices_are_named(Bench& bench) {
  const auto devices = must(bench.open(), "opening the module");
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const Device& device = devices[i];
    require(!device.name.empty(), "device {} has no name", i + 1);
    require(!device.bus.empty(), "the device '{}' names no bus", device.name);
    require(std::visit([](const auto& is) { return is != nullptr; }, device.is),
            "the device '{}' is not there", device.name);
    for (std::size_t other = 0; other < i; ++other) {
      require(devices[other].name != device.name, "two devices are called '{}'", device.name);
    }
  }
  return {};
}

}  // namespace

std::vector<Check> module_checks() {
  return {{"module: devices are named", devices_are_named},
          {"module: a thousand openings leak nothing", thousand_openings}};
}

}  // namespace rig::drivers::conformance
