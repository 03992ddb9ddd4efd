#include "calibration/scan_registration.h"

#include <algorithm>
#include <cmath>

#include "core/scan/frame_file.h"
#include "core/scan/verify.h"

namespace rig::calibration {

namespace {

using geometry::Vec3;

// White margin around a tag's black square, as a share of its edge: one of the eight cells of tag36h11.
constexpr double kMarginShare = 0.125;
// Saturated samples below this share are defects and highlights, not an exposure too long.
constexpr double kMostSaturatedShare = 0.005;

// A frame that was tried.
struct Attempt {
  PoseRegistration result;
  std::size_t seen = 0;
};

}  // namespace

double saturated_share_of_tags(const machine::RigConfig& rig, const geometry::RigidTransform& nominal,
                               const std::vector<std::uint16_t>& mosaic) {
  constexpr int kSteps = 24;
  const geometry::CameraIntrinsics& camera = rig.camera.intrinsics;
  std::size_t count = 0, saturated = 0;
  for (const machine::Fiducial& fiducial : rig.carrier.fiducials) {
    const auto corners = tag_corners(fiducial, kMarginShare * fiducial.size_m);
    const Vec3 across = (1.0 / kSteps) * (corners[1] - corners[0]);
    const Vec3 up = (1.0 / kSteps) * (corners[3] - corners[0]);
    for (int j = 0; j < kSteps; ++j) {
      for (int i = 0; i < kSteps; ++i) {
        const auto pixel =
            geometry::project(camera, nominal.point(corners[0] + (i + 0.5) * across + (j + 0.5) * up));
        if (!pixel) continue;
        const long x = std::lround(pixel->x), y = std::lround(pixel->y);
        if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) continue;
        const auto index = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                           static_cast<std::size_t>(x);
        ++count;
        if (mosaic[index] >= rig.camera.sensor.saturation_dn) ++saturated;
      }
    }
  }
  return count == 0 ? 0 : static_cast<double>(saturated) / static_cast<double>(count);
}

PoseRegistration register_pose(const std::filesystem::path& scan_folder, const machine::RigConfig& rig,
                               const scan::PoseRecord& pose, TagFinder& finder,
                               const RegistrationLimits& limits) {
  const geometry::CameraIntrinsics& camera = rig.camera.intrinsics;
  const geometry::RigidTransform nominal = nominal_camera_from_sample(rig, pose.readback_rad);
  std::vector<scan::FrameRecord> records = pose.frames;
  std::stable_sort(records.begin(), records.end(),
                   [](const scan::FrameRecord& a, const scan::FrameRecord& b) {
                     return a.exposure_s * a.gain > b.exposure_s * b.gain;
                   });

  std::string trouble;
  Attempt best;
  const auto attempt = [&](const scan::FrameRecord& record, const scan::Frame& frame) {
    const GreyImage grey = grey_from_mosaic(frame.pixels, frame.width, frame.height, rig.camera.bayer,
                                            rig.camera.sensor, rig.camera.white_balance);
    Attempt made{register_tags(rig, nominal, finder.find(grey, &camera), limits), 0};
    made.result.frame = record.index;
    made.seen = made.result.tags.size();
    const bool better = best.result.frame < 0 || made.result.registered > best.result.registered ||
                        (made.result.registered == best.result.registered && made.seen > best.seen);
    if (better) best = std::move(made);
  };

  std::vector<std::pair<scan::FrameRecord, scan::Frame>> overexposed;
  std::size_t tried = 0;
  for (const scan::FrameRecord& record : records) {
    auto frame = scan::read_recorded_frame(scan_folder, pose.row, record);
    if (!frame) {
      trouble = frame.error().text();
      continue;
    }
    if (frame->width != camera.width || frame->height != camera.height) {
      trouble = fmt::format("{}: {} x {} pixels where rig.toml says {} x {}", record.file, frame->width,
                            frame->height, camera.width, camera.height);
      continue;
    }
    if (saturated_share_of_tags(rig, nominal, frame->pixels) > kMostSaturatedShare) {
      overexposed.emplace_back(record, std::move(*frame));
      continue;
    }
    attempt(record, *frame);
    ++tried;
    if (best.result.registered) break;
  }
  // The shortest first: the least saturated.
  for (auto frame = overexposed.rbegin(); frame != overexposed.rend() && !best.result.registered; ++frame) {
    attempt(frame->first, frame->second);
    ++tried;
  }
  if (tried == 0) best.result.reason = trouble.empty() ? "the pose has no frames" : trouble;
  best.result.row = pose.row;
  return best.result;
}

}  // namespace rig::calibration
