#include "sim/camera.h"

#include <bit>
#include <cmath>

#include "core/base/random.h"
#include "sim/exposure.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::Result;

VirtualCamera::VirtualCamera(std::shared_ptr<Machine> machine)
    : machine_(std::move(machine)), renderer_(machine_->world()) {}

drivers::CameraCapabilities VirtualCamera::capabilities() const {
  const CameraWorld& c = machine_->world().camera;
  return {c.width, c.height, c.bits, "RGGB", c.min_exposure_s, c.max_exposure_s, c.readout_s, true};
}

Result<void> VirtualCamera::arm() {
  exposure_.reset();
  taken_.clear();
  return {};
}

Result<void> VirtualCamera::trigger(double exposure_s, double gain) {
  if (exposure_) {
    return fail(ErrorCode::busy, "the camera is exposing, or its frame was not fetched", "camera");
  }
  const CameraWorld& camera = machine_->world().camera;
  if (!(exposure_s >= camera.min_exposure_s && exposure_s <= camera.max_exposure_s)) {
    return fail(ErrorCode::bad_input, fmt::format("the camera cannot expose for {} us", exposure_s * 1e6),
                "camera");
  }
  if (!(gain > 0) || !std::isfinite(gain)) {
    return fail(ErrorCode::bad_input, fmt::format("the camera has no gain {}", gain), "camera");
  }
  const std::uint64_t nth = taken_[{exposure_s, gain}]++;
  exposure_ = Exposure{machine_->clock().now(), exposure_s, gain, nth, machine_->scene()};
  ++counter_;
  return {};
}

std::uint64_t VirtualCamera::noise_key(const Exposure& e) const {
  std::uint64_t key = base::mix64(machine_->world().seed);
  for (const std::int64_t counts : e.scene.counts)
    key = base::derive_key(key, static_cast<std::uint64_t>(counts));
  key = base::derive_key(key, std::bit_cast<std::uint64_t>(e.exposure_s));
  key = base::derive_key(key, std::bit_cast<std::uint64_t>(e.gain));
  return base::derive_key(key, e.nth);
}

Result<std::optional<drivers::FrameInfo>> VirtualCamera::fetch(std::span<std::uint16_t> pixels) {
  const World& world = machine_->world();
  if (!exposure_) return fail(ErrorCode::device, "no exposure was triggered", "camera");
  if (pixels.size() !=
      static_cast<std::size_t>(world.camera.width) * static_cast<std::size_t>(world.camera.height)) {
    return fail(ErrorCode::bad_input, "the buffer has not the size of a frame", "camera");
  }
  const Exposure& e = *exposure_;
  if (machine_->clock().now() < e.started + base::seconds(e.exposure_s + world.camera.readout_s)) {
    return std::optional<drivers::FrameInfo>();
  }
  const bool same = rendered_scene_ && rendered_scene_->counts == e.scene.counts &&
                    rendered_scene_->from_above == e.scene.from_above;
  if (!same) {
    Angles angles{};
    for (std::size_t i = 0; i < kAxes; ++i)
      angles[i] = true_angle(world, i, e.scene.counts[i], e.scene.from_above[i]);
    rendered_ = renderer_.render(angles);
    rendered_scene_ = e.scene;
  }
  expose(world.camera, rendered_, e.scene.light * e.exposure_s, e.gain, noise_key(e), pixels);
  const drivers::FrameInfo info{e.exposure_s, e.gain, e.started, counter_};
  exposure_.reset();
  return std::optional<drivers::FrameInfo>(info);
}

Result<void> VirtualCamera::abort() {
  exposure_.reset();
  return {};
}

}  // namespace rig::sim
