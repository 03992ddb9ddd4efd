#include "core/machine/reference_config.h"

#include <algorithm>

#include "core/base/units.h"

namespace rig::machine {

namespace {

constexpr double kPerMilli = 1e-3;
constexpr double kSecondsPerMinute = 60;
constexpr double kLongest_ms = 1e6;

}  // namespace

std::optional<ReferenceConfig> read_reference(const base::ConfigTable& root) {
  const auto table = root.table_if("reference");
  if (!table) return std::nullopt;
  ReferenceConfig out;
  const auto pose = table->numbers("pose_deg", kAxisCount, {-360, 360});
  if (pose.size() == kAxisCount)
    std::transform(pose.begin(), pose.end(), out.pose_rad.begin(), base::radians);
  out.exposure_s = kPerMilli * table->number("exposure_ms", {1e-3, kLongest_ms});
  out.dark_exposure_s = kPerMilli * table->number("dark_exposure_ms", {1e-3, kLongest_ms});
  out.every_poses = static_cast<int>(table->integer_or("every_poses", 0, 0, 1000000));
  out.every_s = kSecondsPerMinute * table->number_or("every_min", 0, {0, 1e5});
  if (out.every_poses == 0 && out.every_s == 0) {
    table->error("every_poses", "neither every_poses nor every_min says when",
                 "give one of them, or remove [reference]");
  }
  out.band = table->number_or("band", out.band, {1e-6, 1});
  out.evenness = table->number_or("evenness", out.evenness, {1e-6, 1});
  out.dark_dn = table->number_or("dark_dn", out.dark_dn, {1e-6, 65535});
  out.shift_px = table->number_or("shift_px", out.shift_px, {1e-3, 1e4});
  out.turn_rad = base::radians(table->number_or("turn_deg", base::degrees(out.turn_rad), {1e-4, 180}));
  out.attempts = static_cast<int>(table->integer_or("attempts", out.attempts, 1, 1000));
  out.again_s = kSecondsPerMinute * table->number_or("again_min", out.again_s / kSecondsPerMinute, {0, 1e5});
  return out;
}

}  // namespace rig::machine
