#include "sim/fault_plan.h"

#include <algorithm>
#include <array>
#include <optional>

#include "core/base/units.h"

namespace rig::sim {

namespace {

using base::ConfigTable;
using base::Range;

const std::vector<std::string> kAxisDevices{"roll", "tilt", "pan", "arm"};
const std::vector<std::string> kCameraDevice{"camera"};
const std::vector<std::string> kLightDevice{"light"};
const std::vector<std::string> kLinesDevice{"lines"};
const std::vector<std::string> kAllDevices{"roll", "tilt", "pan", "arm", "camera", "light", "lines"};

enum class Unit { one, degrees, seconds };

// What a kind of fault can be of, and the key that says how much.
struct Kind {
  const char* name;
  FaultKind kind;
  const std::vector<std::string>* devices;
  const char* amount_key;  // null: there is nothing to say
  Unit unit;
  std::optional<double> usual;
  Range range;
};

const std::array<Kind, 19>& kinds() {
  static const std::array<Kind, 19> all{{
      {"stall", FaultKind::stall, &kAxisDevices, "share", Unit::one, 0.5, {0, 0.99}},
      {"lost-steps", FaultKind::lost_steps, &kAxisDevices, "by_deg", Unit::degrees, std::nullopt, {-90, 90}},
      {"backlash", FaultKind::backlash, &kAxisDevices, "by_deg", Unit::degrees, std::nullopt, {0, 10}},
      {"limit-switch", FaultKind::limit_switch, &kAxisDevices, nullptr, Unit::one, 0.0, {0, 0}},
      {"limit-line", FaultKind::limit_line, &kAxisDevices, nullptr, Unit::one, 0.0, {0, 0}},
      {"emergency-stop", FaultKind::emergency_stop, &kLinesDevice, "by_s", Unit::seconds, 1.0, {0, 1e6}},
      {"slow", FaultKind::slow, &kAllDevices, "by_s", Unit::seconds, std::nullopt, {0, 86400}},
      {"garbage", FaultKind::garbage, &kAllDevices, nullptr, Unit::one, 0.0, {0, 0}},
      {"lost", FaultKind::lost, &kAllDevices, nullptr, Unit::one, 0.0, {0, 0}},
      {"unplugged", FaultKind::unplugged, &kAllDevices, nullptr, Unit::one, 0.0, {0, 0}},
      {"dropped-frame", FaultKind::dropped_frame, &kCameraDevice, nullptr, Unit::one, 0.0, {0, 0}},
      {"corrupt-frame", FaultKind::corrupt_frame, &kCameraDevice, nullptr, Unit::one, 0.0, {0, 0}},
      {"incomplete-frame", FaultKind::incomplete_frame, &kCameraDevice, nullptr, Unit::one, 0.0, {0, 0}},
      {"busy", FaultKind::busy_camera, &kCameraDevice, "by_s", Unit::seconds, 1.0, {0, 86400}},
      {"light-fails", FaultKind::light_fails, &kLightDevice, nullptr, Unit::one, 0.0, {0, 0}},
      {"light-drift", FaultKind::light_drift, &kLightDevice, "share", Unit::one, std::nullopt, {0, 1}},
      {"light-excursion",
       FaultKind::light_excursion,
       &kLightDevice,
       "share",
       Unit::one,
       std::nullopt,
       {-1, 1}},
      {"clock-step", FaultKind::clock_step, &kLinesDevice, "by_s", Unit::seconds, std::nullopt, {-1e9, 1e9}},
      {"disk-full", FaultKind::disk_full, &kLinesDevice, "by_s", Unit::seconds, 1.0, {0, 1e6}},
  }};
  return all;
}

Fault read_fault(const ConfigTable& t) {
  constexpr double kLongest_s = 1e9;
  constexpr std::int64_t kMost = std::int64_t{1} << 40;
  std::vector<std::string> names;
  for (const Kind& kind : kinds()) names.emplace_back(kind.name);
  Fault fault;
  const std::string name = t.choice("kind", names);
  const auto found =
      std::find_if(kinds().begin(), kinds().end(), [&](const Kind& kind) { return name == kind.name; });
  if (found == kinds().end()) {
    t.leave_to_others();  // what else stands here cannot be judged without the kind
    return fault;
  }
  fault.kind = found->kind;
  if (t.has("device")) fault.device = t.choice("device", *found->devices);
  const bool has_side = fault.kind == FaultKind::limit_switch || fault.kind == FaultKind::limit_line;
  if (has_side) fault.high_side = t.choice("side", {"low", "high"}) == "high";
  if (found->amount_key != nullptr) {
    const double amount = found->usual ? t.number_or(found->amount_key, *found->usual, found->range)
                                       : t.number(found->amount_key, found->range);
    fault.amount = found->unit == Unit::degrees ? base::radians(amount) : amount;
  }
  fault.from_s = t.number_or("from_s", 0, {0, kLongest_s});
  if (t.has("for_s")) fault.until_s = fault.from_s + t.number("for_s", {0, kLongest_s});
  fault.chance = t.number_or("chance", 1, {0, 1});
  fault.after = static_cast<std::uint64_t>(t.integer_or("after", 0, 0, kMost));
  fault.times = static_cast<std::uint64_t>(t.integer_or("times", kMost, 0, kMost));
  return fault;
}

}  // namespace

FaultPlan read_fault_plan(const ConfigTable& table) {
  FaultPlan plan;
  plan.seed = static_cast<std::uint64_t>(table.integer_or("seed", 0, 0, std::int64_t{1} << 62));
  for (const ConfigTable& fault : table.tables("fault")) plan.faults.push_back(read_fault(fault));
  return plan;
}

}  // namespace rig::sim
