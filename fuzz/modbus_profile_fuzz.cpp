// Whatever the description of a Modbus drive holds: it is read, or every mistake in it is told in words; and
// what was read can be used, with the options as they are and at both ends of their ranges.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/modbus_axis/reading.h"

namespace {

using namespace rig::drivers::modbus;

void use(const Profile& profile, const OptionValues& options) {
  const ReadPlan plan = plan_reads(profile, options);
  std::vector<std::vector<std::uint16_t>> words;
  for (const Block& block : plan.blocks) words.emplace_back(block.count, std::uint16_t{0xA5C3});
  if (std::isnan(decode_reading(profile, options, plan, words).position_counts)) std::abort();
  for (const double quantity : {0.0, 1.0, -12345.6, 1e12}) {
    Quantities quantities;
    for (double& each : quantities.of) each = quantity;
    for (const auto* steps :
         {&profile.expect, &profile.setup, &profile.enable, &profile.disable, &profile.clear_alarm,
          &profile.home, &profile.move, &profile.stop, &profile.soft_limits}) {
      for (const Step& step : *steps) {
        const auto write = fill_in(step, profile.options, options, profile.values, quantities);
        if (!write && write.error().what.empty()) std::abort();
        if (write && (write->words.empty() || write->words.size() > 123)) std::abort();
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto profile = parse_profile(text, "drive.toml");
  if (!profile) {
    if (profile.error().what.empty()) std::abort();
    return 0;
  }
  OptionValues usual, low, high;
  for (const Option& option : profile->options) {
    usual.push_back(option.fallback);
    low.push_back(option.low);
    high.push_back(option.high);
  }
  for (const OptionValues* options : {&usual, &low, &high}) use(*profile, *options);
  return 0;
}
