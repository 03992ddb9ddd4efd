#include "drivers/modbus_axis/reading.h"

#include <algorithm>
#include <set>
#include <tuple>

namespace rig::drivers::modbus {

namespace {

// Well below what every drive takes; a longer answer also blocks the line for the others' stops.
constexpr std::size_t kMostWords = 32;

std::set<std::size_t> needed(const Profile& profile, const OptionValues& options) {
  std::set<std::size_t> registers{profile.position};
  if (profile.temperature) registers.insert(*profile.temperature);
  const auto add = [&](const Flag& flag) {
    if (flag.kind == Flag::Kind::test && is_told(flag, options)) registers.insert(flag.of_register);
  };
  for (const Flag* flag :
       {&profile.fault, &profile.enabled, &profile.homed, &profile.low_limit, &profile.high_limit}) {
    add(*flag);
  }
  if (profile.moving) add(*profile.moving);
  if (profile.complete) add(*profile.complete);
  return registers;
}

}  // namespace

ReadPlan plan_reads(const Profile& profile, const OptionValues& options) {
  const std::set<std::size_t> chosen = needed(profile, options);
  std::vector<std::size_t> order(chosen.begin(), chosen.end());
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Register &x = profile.registers[a], &y = profile.registers[b];
    return std::tuple(x.table, x.at(options), x.words()) < std::tuple(y.table, y.at(options), y.words());
  });
  ReadPlan plan;
  std::size_t position_block = 0;
  for (const std::size_t index : order) {
    const Register& reg = profile.registers[index];
    const std::uint16_t address = reg.at(options);
    const std::size_t end = address + reg.words();
    Block* last = plan.blocks.empty() ? nullptr : &plan.blocks.back();
    if (last == nullptr || last->table != reg.table || address > last->address + last->count ||
        end - last->address > kMostWords) {
      plan.blocks.push_back({reg.table, address, static_cast<std::uint16_t>(reg.words())});
      last = &plan.blocks.back();
    }
    last->count = static_cast<std::uint16_t>(std::max<std::size_t>(last->count, end - last->address));
    const std::size_t block = plan.blocks.size() - 1;
    plan.places.push_back({index, block, static_cast<std::size_t>(address - last->address)});
    if (index == profile.position) position_block = block;
  }
  std::swap(plan.blocks[position_block], plan.blocks.back());
  for (ReadPlan::Place& place : plan.places) {
    if (place.block == position_block) {
      place.block = plan.blocks.size() - 1;
    } else if (place.block == plan.blocks.size() - 1) {
      place.block = position_block;
    }
  }
  return plan;
}

Reading decode_reading(const Profile& profile, const OptionValues& options, const ReadPlan& plan,
                       const std::vector<std::vector<std::uint16_t>>& words) {
  std::vector<std::int64_t> raw(profile.registers.size(), 0);
  for (const ReadPlan::Place& place : plan.places) {
    const Register& reg = profile.registers[place.of_register];
    raw[place.of_register] =
        decode(std::span(words[place.block]).subspan(place.offset, reg.words()), reg.format);
  }
  const auto flag = [&](const Flag& f) {
    return holds(f, f.kind == Flag::Kind::test ? raw[f.of_register] : 0, options);
  };
  const auto scaled = [&](std::size_t index) {
    return static_cast<double>(raw[index]) * profile.registers[index].factor.value(options);
  };
  Reading reading;
  reading.position_counts = scaled(profile.position);
  reading.fault = flag(profile.fault);
  reading.enabled = flag(profile.enabled);
  reading.homed = flag(profile.homed);
  if (profile.moving) reading.moving = flag(*profile.moving);
  if (profile.complete) reading.complete = flag(*profile.complete);
  reading.low_limit = flag(profile.low_limit);
  reading.high_limit = flag(profile.high_limit);
  if (profile.temperature) reading.temperature_c = scaled(*profile.temperature);
  return reading;
}

std::string alarm_text(const Profile& profile, std::optional<std::int64_t> code) {
  if (!code) return "the drive reports an alarm";
  const auto found = profile.alarms.find(*code);
  return fmt::format("alarm 0x{:02X}: {}", *code,
                     found != profile.alarms.end() ? found->second : "see the drive's manual");
}

}  // namespace rig::drivers::modbus
