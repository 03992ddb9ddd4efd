#include "daemon/place.h"

#include <algorithm>
#include <tuple>

#include "calibration/fiducials/grey_image.h"
#include "calibration/fiducials/tag_finder.h"
#include "core/scan/verify.h"

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

Result<std::vector<calibration::TagSighting>> tags_in_frame(const machine::RigConfig& rig,
                                                            std::span<const std::uint16_t> pixels) {
  auto finder = calibration::TagFinder::create(rig.carrier.tag_family);
  if (!finder) return pass(finder);
  const machine::CameraConfig& camera = rig.camera;
  const auto grey = calibration::grey_from_mosaic(pixels, camera.intrinsics.width, camera.intrinsics.height,
                                                  camera.bayer, camera.sensor, camera.white_balance);
  return finder->find(grey, &camera.intrinsics);
}

Result<std::shared_ptr<const PlaceReference>> find_place(const std::filesystem::path& scan,
                                                         const scan::Journal& journal,
                                                         const machine::RigConfig& rig) {
  const auto poses = journal.poses();
  if (!poses) return pass(poses);
  const auto last = std::max_element(poses->begin(), poses->end(),
                                     [](const scan::PoseRecord& a, const scan::PoseRecord& b) {
                                       return std::tie(a.committed, a.row) < std::tie(b.committed, b.row);
                                     });
  if (last == poses->end()) return std::shared_ptr<const PlaceReference>();
  auto best = std::make_shared<PlaceReference>();
  best->row = last->row;
  best->target_rad = last->target_rad;
  for (const scan::FrameRecord& record : last->frames) {
    const auto frame = scan::read_recorded_frame(scan, last->row, record);
    if (!frame) return pass(frame);
    if (frame->width != rig.camera.intrinsics.width || frame->height != rig.camera.intrinsics.height) {
      return fail(ErrorCode::bad_input, "was taken with another camera than rig.toml has", record.file);
    }
    auto tags = tags_in_frame(rig, frame->pixels);
    if (!tags) return pass(tags);
    if (tags->size() <= best->tags.size()) continue;
    best->tags = std::move(*tags);
    best->exposure_s = record.exposure_s;
  }
  if (best->tags.size() < calibration::kFewestCompared) {
    return fail(ErrorCode::not_found,
                fmt::format("the frames of row {} show {} fiducials, {} are needed to see whether the sample "
                            "or the rig moved",
                            best->row, best->tags.size(), calibration::kFewestCompared));
  }
  return std::shared_ptr<const PlaceReference>(std::move(best));
}

std::string what_moved_since(const PlaceReference& place, const std::vector<calibration::TagSighting>& now,
                             const machine::RigConfig& rig) {
  const machine::ReferenceConfig tolerance = rig.unattended.reference.value_or(machine::ReferenceConfig{});
  return calibration::what_moved(calibration::compare_fiducials(place.tags, now),
                                 {tolerance.shift_px, tolerance.turn_rad});
}

}  // namespace rig::daemon
