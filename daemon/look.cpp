#include "daemon/look.h"

#include "core/machine/kinematics.h"
#include "core/scan/scan_directory.h"
#include "daemon/frame_facts.h"
#include "daemon/place.h"

namespace rig::daemon {

using base::pass;
using base::Result;

namespace {

// Of a patch's edges: nominal geometry may be off by as much as its margin.
constexpr double kInner = 0.6;
constexpr int kFlatParts = 4;  // in each direction
constexpr double kMostSaturated = 0.01;

bool is_in_image(const machine::RigConfig& rig, const std::vector<geometry::Vec2>& polygon) {
  for (const geometry::Vec2& corner : polygon) {
    if (!(corner.x >= 0 && corner.y >= 0 && corner.x <= rig.camera.intrinsics.width - 1 &&
          corner.y <= rig.camera.intrinsics.height - 1)) {
      return false;
    }
  }
  return true;
}

std::vector<double> patch_means(const machine::RigConfig& rig, const JudgeLook& look,
                                std::span<const std::uint16_t> pixels) {
  std::vector<double> means;
  for (const machine::Patch& patch : rig.carrier.patches) {
    const auto outline = machine::rectangle_outline(rig, look.target_rad, {patch.x_m, patch.y_m},
                                                    kInner * patch.width_m, kInner * patch.height_m);
    if (!outline || !is_in_image(rig, *outline)) continue;  // as at every other visit: the pose is the same
    if (const auto mean = mean_above_black_dn(rig.camera, pixels, *outline)) means.push_back(*mean);
  }
  return means;
}

// The flat's parts, row by row: rectangles of the target, or of the whole image where it fills that.
std::vector<std::vector<geometry::Vec2>> flat_parts(const machine::RigConfig& rig,
                                                    const machine::FlatConfig& flat) {
  std::vector<std::vector<geometry::Vec2>> parts;
  constexpr double kStep = 1.0 / kFlatParts;
  const auto width_px = static_cast<double>(rig.camera.intrinsics.width);
  const auto height_px = static_cast<double>(rig.camera.intrinsics.height);
  for (int row = 0; row < kFlatParts; ++row) {
    for (int column = 0; column < kFlatParts; ++column) {
      if (!flat.target) {
        // Pixel centres are at whole numbers.
        const double left = column * kStep * width_px - 0.5;
        const double top = row * kStep * height_px - 0.5;
        const double right = left + kStep * width_px;
        const double bottom = top + kStep * height_px;
        parts.push_back({{left, top}, {right, top}, {right, bottom}, {left, bottom}});
        continue;
      }
      const double width_m = kInner * flat.target->width_m;
      const double height_m = kInner * flat.target->height_m;
      const geometry::Vec2 centre{flat.target->x_m + ((column + 0.5) * kStep - 0.5) * width_m,
                                  flat.target->y_m + ((row + 0.5) * kStep - 0.5) * height_m};
      if (auto outline =
              machine::rectangle_outline(rig, flat.pose_rad, centre, kStep * width_m, kStep * height_m))
        parts.push_back(std::move(*outline));
    }
  }
  return parts;
}

Result<std::vector<double>> flat_means(const machine::RigConfig& rig, std::span<const std::uint16_t> pixels) {
  const machine::FlatConfig& flat = *rig.unattended.reference->flat;
  std::vector<double> means;
  for (const auto& part : flat_parts(rig, flat)) {
    // What is saturated looks the same whatever the light does.
    if (saturated_share(rig.camera, pixels, part) > kMostSaturated) {
      return base::fail(base::ErrorCode::bad_input, "the flat is saturated", {},
                        "shorten [reference.flat] exposure_ms");
    }
    if (const auto mean = mean_above_black_dn(rig.camera, pixels, part)) means.push_back(*mean);
  }
  return means;
}

Result<LookFinding> judge_reference(const machine::RigConfig& rig, const std::filesystem::path& scan,
                                    const JudgeLook& look, std::span<const std::uint16_t> pixels) {
  scan::FrameFacts facts;
  facts.row = kVisitRow;
  facts.target_rad = look.target_rad;
  facts.readback_rad = look.readback_rad;
  facts.exposure_s = look.info.exposure_s;
  facts.gain = look.info.gain;
  facts.bayer = geometry::text_from_bayer(rig.camera.bayer);
  facts.bits = rig.camera.sensor.bits;
  const auto hash = scan::store_look(scan, look.visit, look.name, facts, rig.camera.intrinsics.width,
                                     rig.camera.intrinsics.height, pixels.data());
  if (!hash) return pass(hash);
  LookFinding finding;
  finding.record.name = look.name;
  finding.record.file =
      (scan::visit_folder(scan, look.visit) / (look.name + ".tif")).lexically_relative(scan).string();
  finding.record.exposure_s = look.info.exposure_s;
  finding.record.started = look.info.started;
  finding.record.sha256 = *hash;
  if (look.name == "dark") {
    if (const auto mean = mean_above_black_dn(rig.camera, pixels, {})) finding.record.means_dn = {*mean};
  } else if (look.name == "flat") {
    auto means = flat_means(rig, pixels);
    if (!means) return pass(means);
    finding.record.means_dn = std::move(*means);
  } else {
    finding.record.means_dn = patch_means(rig, look, pixels);
  }
  return finding;
}

}  // namespace

Result<LookFinding> judge(const machine::RigConfig& rig, const std::filesystem::path& scan,
                          const JudgeLook& look, std::span<const std::uint16_t> pixels) {
  if (look.kind == Visit::Kind::reference) return judge_reference(rig, scan, look, pixels);
  const auto tags = tags_in_frame(rig, pixels);
  if (!tags) return pass(tags);
  LookFinding finding;
  for (const calibration::TagSighting& tag : *tags) finding.tags.push_back(tag.id);
  if (look.kind == Visit::Kind::place) finding.moved = what_moved_since(*look.place, *tags, rig);
  return finding;
}

}  // namespace rig::daemon
