#include "sim/camera.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/random.h"
#include "sim/exposure.h"
#include "sim/hash_painter.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

const std::string kName = "camera";

// What a bad cable does: the lines from some point on never came, or bits beyond the sensor's are set.
void damage(const CameraWorld& camera, std::uint64_t key, std::span<std::uint16_t> pixels) {
  constexpr int kAllBits = 16;
  const std::size_t lines = pixels.size() / static_cast<std::size_t>(camera.width);
  const std::size_t from = base::derive_key(key, 1) % lines;
  const auto damaged = pixels.subspan(from * static_cast<std::size_t>(camera.width));
  if (camera.bits == kAllBits || base::derive_key(key, 2) % 2 == 0) {
    std::fill(damaged.begin(), damaged.end(), std::uint16_t{0});
  } else {
    for (std::uint16_t& sample : damaged) sample = static_cast<std::uint16_t>(sample | 0x8000U);
  }
}

}  // namespace

VirtualCamera::VirtualCamera(std::shared_ptr<Machine> machine) : machine_(std::move(machine)) {
  if (!machine_->world().camera.hashed) renderer_ = std::make_unique<Renderer>(machine_->world());
  machine_->on_trigger_line([this] {
    const std::lock_guard lock(mutex_);
    if (!awaiting_) return;  // a pulse that nothing waits for
    const auto [exposure_s, gain] = *std::exchange(awaiting_, std::nullopt);
    expose_now(exposure_s, gain);
  });
}

drivers::CameraCapabilities VirtualCamera::capabilities() const {
  const CameraWorld& c = machine_->world().camera;
  return {c.width, c.height, c.bits, "RGGB", c.min_exposure_s, c.max_exposure_s, c.readout_s, true};
}

VirtualCamera::~VirtualCamera() {
  machine_->on_trigger_line({});
}

Result<void> VirtualCamera::arm() {
  if (auto reached = machine_->reach(kName); !reached) return reached;
  const std::lock_guard lock(mutex_);
  exposure_.reset();
  awaiting_.reset();
  taken_.clear();
  return {};
}

Result<void> VirtualCamera::check(double exposure_s, double gain) const {
  if (exposure_ || awaiting_ || machine_->clock().now() < busy_until_) {
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
  return {};
}

void VirtualCamera::expose_now(double exposure_s, double gain) {
  const std::uint64_t nth = taken_[{exposure_s, gain}]++;
  const bool dropped = machine_->strike(FaultKind::dropped_frame, kName).has_value();
  exposure_ = Exposure{machine_->clock().now(), exposure_s, gain, nth, dropped, machine_->scene()};
  ++counter_;
}

Result<void> VirtualCamera::trigger(double exposure_s, double gain) {
  if (auto reached = machine_->reach(kName); !reached) return reached;
  const std::lock_guard lock(mutex_);
  if (auto ok = check(exposure_s, gain); !ok) return ok;
  expose_now(exposure_s, gain);
  return {};
}

Result<void> VirtualCamera::await_trigger(double exposure_s, double gain) {
  if (auto reached = machine_->reach(kName); !reached) return reached;
  const std::lock_guard lock(mutex_);
  if (auto ok = check(exposure_s, gain); !ok) return ok;
  awaiting_ = {exposure_s, gain};
  return {};
}

std::uint64_t VirtualCamera::noise_key(const Exposure& e) const {
  std::uint64_t key = base::mix64(machine_->world().seed);
  for (const std::int64_t counts : e.scene.counts)
    key = base::derive_key(key, static_cast<std::uint64_t>(counts));
  for (const double astray : e.scene.astray) {
    if (astray != 0) key = base::derive_key(key, std::bit_cast<std::uint64_t>(astray));
  }
  key = base::derive_key(key, std::bit_cast<std::uint64_t>(e.exposure_s));
  key = base::derive_key(key, std::bit_cast<std::uint64_t>(e.gain));
  return base::derive_key(key, e.nth);
}

void VirtualCamera::paint(const Exposure& e, std::span<std::uint16_t> pixels) {
  const World& world = machine_->world();
  const double effective_s = e.scene.light * e.exposure_s;
  if (world.camera.hashed) return paint_hashed(world.camera, effective_s, e.gain, noise_key(e), pixels);
  const bool same = rendered_scene_ && rendered_scene_->counts == e.scene.counts &&
                    rendered_scene_->from_above == e.scene.from_above &&
                    rendered_scene_->astray == e.scene.astray;
  if (!same) {
    Angles angles{};
    for (std::size_t i = 0; i < kAxes; ++i)
      angles[i] = true_angle(world, i, e.scene.counts[i], e.scene.from_above[i]) + e.scene.astray[i];
    rendered_ = renderer_->render(angles);
    rendered_scene_ = e.scene;
  }
  expose(world.camera, rendered_, effective_s, e.gain, noise_key(e), pixels);
}

Result<std::optional<drivers::FrameInfo>> VirtualCamera::fetch(std::span<std::uint16_t> pixels) {
  if (auto reached = machine_->reach(kName); !reached) return base::pass(reached);
  const World& world = machine_->world();
  const std::lock_guard lock(mutex_);
  if (awaiting_) return std::optional<drivers::FrameInfo>();  // the pulse never came, or comes still
  if (!exposure_) return fail(ErrorCode::device, "no exposure was triggered", "camera");
  if (pixels.size() !=
      static_cast<std::size_t>(world.camera.width) * static_cast<std::size_t>(world.camera.height)) {
    return fail(ErrorCode::bad_input, "the buffer has not the size of a frame", "camera");
  }
  const Exposure& e = *exposure_;
  const bool over =
      machine_->clock().now() >= e.started + base::seconds(e.exposure_s + world.camera.readout_s);
  if (!over || e.dropped) {
    return std::optional<drivers::FrameInfo>();
  }
  if (machine_->strike(FaultKind::incomplete_frame, kName)) {
    exposure_.reset();
    return fail(ErrorCode::damaged, "part of the frame never came", "camera");
  }
  paint(e, pixels);
  if (machine_->strike(FaultKind::corrupt_frame, kName)) damage(world.camera, counter_, pixels);
  drivers::FrameInfo info{e.exposure_s, e.gain, e.started, counter_};
  if (machine_->strike(FaultKind::garbage, kName)) info.exposure_s = std::numeric_limits<double>::quiet_NaN();
  exposure_.reset();
  return std::optional<drivers::FrameInfo>(info);
}

Result<void> VirtualCamera::abort() {
  if (auto reached = machine_->reach(kName); !reached) return reached;
  const std::lock_guard lock(mutex_);
  awaiting_.reset();
  if (exposure_) {
    if (const auto busy_s = machine_->strike(FaultKind::busy_camera, kName))
      busy_until_ = machine_->clock().now() + base::seconds(*busy_s);
  }
  exposure_.reset();
  return {};
}

}  // namespace rig::sim
