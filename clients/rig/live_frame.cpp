#include "clients/rig/live_frame.h"

#include <algorithm>
#include <cstring>

#include "calibration/fiducials/grey_image.h"
#include "core/base/units.h"
#include "core/machine/kinematics.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr std::array<double, 3> kNoWhiteBalance{1, 1, 1};

struct Camera {
  geometry::BayerPattern bayer = geometry::BayerPattern::none;
  geometry::SensorModel sensor;
  std::array<double, 3> white_balance = kNoWhiteBalance;
};

Result<Camera> camera_of(const protocol::Frame& frame, const std::optional<machine::RigConfig>& rig) {
  const auto bayer = geometry::bayer_from_text(frame.bayer());
  if (!bayer) return pass(bayer);
  if (frame.bits() < 1 || frame.bits() > 16)
    return fail(ErrorCode::damaged, fmt::format("rigd's answer has {} bits a sample", frame.bits()));
  Camera camera;
  camera.bayer = *bayer;
  camera.sensor.bits = static_cast<int>(frame.bits());
  camera.sensor.saturation_dn = static_cast<double>((1U << frame.bits()) - 1);
  if (!rig) return camera;
  const auto& known = rig->camera;
  if (static_cast<std::uint32_t>(known.intrinsics.width) != frame.width() ||
      static_cast<std::uint32_t>(known.intrinsics.height) != frame.height() ||
      known.sensor.bits != camera.sensor.bits || known.bayer != camera.bayer) {
    return fail(ErrorCode::bad_input, "rig.toml describes another camera than the frame comes from", {},
                "name with --config the file that rigd was started with");
  }
  camera.sensor = known.sensor;
  camera.white_balance = known.white_balance;
  return camera;
}

std::vector<std::uint16_t> samples_of(const protocol::Frame& frame) {
  std::vector<std::uint16_t> samples(frame.raw().size() / 2);
  std::memcpy(samples.data(), frame.raw().data(), 2 * samples.size());
  return samples;
}

std::vector<int> ids_in(const calibration::GreyImage& image, calibration::TagFinder& finder) {
  std::vector<int> ids;
  for (const auto& sighting : finder.find(image)) ids.push_back(sighting.id);
  return ids;
}

}  // namespace

std::optional<std::vector<geometry::Vec2>> sample_in_image(const machine::RigConfig& rig,
                                                           const protocol::Status& status) {
  machine::JointAngles angles{};
  if (status.axes_size() != static_cast<int>(machine::kAxisCount)) return std::nullopt;
  for (int i = 0; i < status.axes_size(); ++i) {
    if (!status.axes(i).homed()) return std::nullopt;
    angles.at(static_cast<std::size_t>(i)) = base::radians(status.axes(i).position_deg());
  }
  return machine::sample_outline(rig, angles);
}

Result<LiveFrame> measure_frame(const protocol::Frame& frame, FrameContent content,
                                const std::optional<machine::RigConfig>& rig, const protocol::Status& status,
                                calibration::TagFinder& finder) {
  if (auto ok = check_frame(frame, content); !ok) return pass(ok);
  const auto camera = camera_of(frame, rig);
  if (!camera) return pass(camera);
  auto outline = rig ? sample_in_image(*rig, status) : std::nullopt;
  LiveFrame out;
  out.content = content;
  out.exposure_us = frame.exposure_us();
  if (content == FrameContent::raw) {
    const auto width = static_cast<int>(frame.width());
    const auto height = static_cast<int>(frame.height());
    const auto samples = samples_of(frame);
    out.region = region_around(outline.value_or(std::vector<geometry::Vec2>{}), width, height);
    out.focus = focus_measure(green_of_mosaic(samples, width, camera->bayer, camera->sensor, out.region));
    out.exposed = exposed_of_mosaic(samples, width, camera->sensor, out.region);
    out.fiducials = ids_in(calibration::grey_from_mosaic(samples, width, height, camera->bayer,
                                                         camera->sensor, camera->white_balance),
                           finder);
    return out;
  }
  const auto width = static_cast<int>(frame.preview_width());
  const auto height = static_cast<int>(frame.preview_height());
  if (outline) {
    const double scale = static_cast<double>(width) / static_cast<double>(std::max(frame.width(), 1U));
    for (auto& corner : *outline) corner = {corner.x * scale, corner.y * scale};
  }
  out.region = region_around(outline.value_or(std::vector<geometry::Vec2>{}), width, height);
  out.focus = focus_measure(green_of_preview(frame, out.region));
  out.exposed = exposed_of_preview(frame, out.region);
  auto whole = green_of_preview(frame, {0, 0, width, height});
  // The finder takes digital numbers.
  for (float& v : whole.pixels) v *= 255;
  out.fiducials = ids_in({width, height, std::move(whole.pixels)}, finder);
  return out;
}

}  // namespace rig::client
