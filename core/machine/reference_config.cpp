#include "core/machine/reference_config.h"

#include <algorithm>

#include "core/base/units.h"

namespace rig::machine {

namespace {

constexpr double kPerMilli = 1e-3;
constexpr double kSecondsPerMinute = 60;
constexpr double kLongest_ms = 1e6;
constexpr double kFarthest_mm = 1e5;

void read_pose(const base::ConfigTable& table, JointAngles& pose_rad) {
  const auto pose = table.numbers("pose_deg", kAxisCount, {-360, 360});
  if (pose.size() == kAxisCount) std::transform(pose.begin(), pose.end(), pose_rad.begin(), base::radians);
}

FlatConfig read_flat(const base::ConfigTable& table, const JointAngles& reference_rad) {
  FlatConfig flat;
  flat.pose_rad = reference_rad;
  if (table.has("pose_deg")) read_pose(table, flat.pose_rad);
  flat.exposure_s = kPerMilli * table.number("exposure_ms", {1e-3, kLongest_ms});
  if (table.has("target_mm")) {
    const auto target = table.numbers("target_mm", 4, {-kFarthest_mm, kFarthest_mm});
    if (target.size() == 4) {
      flat.target = FlatConfig::Target{kPerMilli * target[0], kPerMilli * target[1], kPerMilli * target[2],
                                       kPerMilli * target[3]};
      if (!(target[2] > 0 && target[3] > 0))
        table.error("target_mm", "has no size", "x and y of its centre, width, height");
    }
  }
  flat.band = table.number_or("band", flat.band, {1e-6, 1});
  flat.evenness = table.number_or("evenness", flat.evenness, {1e-6, 1});
  return flat;
}

}  // namespace

std::optional<ReferenceConfig> read_reference(const base::ConfigTable& root) {
  const auto table = root.table_if("reference");
  if (!table) return std::nullopt;
  ReferenceConfig out;
  read_pose(*table, out.pose_rad);
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
  if (const auto flat = table->table_if("flat")) out.flat = read_flat(*flat, out.pose_rad);
  return out;
}

}  // namespace rig::machine
