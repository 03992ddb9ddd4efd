#include "drivers/aravis_camera/camera.h"

namespace rig::drivers::aravis {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Steady = std::chrono::steady_clock;

namespace {

// A frame that is so late makes one ask whether the camera is still there, and so often.
constexpr std::chrono::milliseconds kOverdue{500};

}  // namespace

GenicamCamera::GenicamCamera(Settings settings, base::Clock& clock, const Log& log)
    : settings_(std::move(settings)), clock_(clock) {
  keeper_ = std::make_unique<Keeper>(
      [this, log](std::function<void()> on_lost) {
        return Session::open(settings_, clock_, log, std::move(on_lost));
      },
      settings_.called(), settings_.answer, log);
}

Result<std::unique_ptr<GenicamCamera>> GenicamCamera::open(Settings settings, base::Clock& clock,
                                                           const Log& log) {
  const auto within = settings.open_within;
  std::unique_ptr<GenicamCamera> camera(new GenicamCamera(std::move(settings), clock, log));
  auto capabilities = camera->keeper_->wait_until_open(within);
  if (!capabilities) return pass(capabilities);
  camera->capabilities_ = *capabilities;
  return camera;
}

Result<void> GenicamCamera::arm() {
  pending_.reset();
  return keeper_->ask<void>([](Session& session) { return session.arm(); });
}

Result<void> GenicamCamera::expose(double exposure_s, double gain, bool by_line) {
  if (pending_) {
    return fail(ErrorCode::busy, "the camera is exposing, or its frame was not fetched", settings_.called());
  }
  const int opened = keeper_->times_opened();
  auto done = keeper_->ask<void>([=](Session& session) { return session.expose(exposure_s, gain, by_line); });
  if (!done) return done;
  const auto lasts = std::chrono::duration_cast<Steady::duration>(
      std::chrono::duration<double>(exposure_s + capabilities_.readout_s));
  pending_ = Pending{opened, by_line, Steady::now() + lasts + kOverdue};
  return {};
}

Result<void> GenicamCamera::trigger(double exposure_s, double gain) {
  return expose(exposure_s, gain, false);
}

Result<void> GenicamCamera::await_trigger(double exposure_s, double gain) {
  return expose(exposure_s, gain, true);
}

void GenicamCamera::probe_where_overdue() {
  if (Steady::now() < pending_->due) return;
  pending_->due = Steady::now() + kOverdue;
  keeper_->probe();
}

Result<std::optional<FrameInfo>> GenicamCamera::fetch(std::span<std::uint16_t> pixels) {
  if (!pending_) return fail(ErrorCode::device, "no exposure was triggered", settings_.called());
  if (pending_->opened != keeper_->times_opened()) {
    pending_.reset();
    return fail(ErrorCode::lost, "the camera was away during the exposure", settings_.called());
  }
  auto taken = keeper_->look<std::optional<Taken>>([&](Session& session) { return session.take(pixels); });
  if (!taken) {
    if (taken.error().code != ErrorCode::bad_input) pending_.reset();
    return pass(taken);
  }
  if (!*taken) {
    probe_where_overdue();
    return std::optional<FrameInfo>();
  }
  pending_.reset();
  counter_ += (*taken)->advance;
  FrameInfo info = (*taken)->info;
  info.counter = counter_;
  return std::optional<FrameInfo>(info);
}

Result<void> GenicamCamera::abort() {
  pending_.reset();
  return keeper_->ask<void>([](Session& session) { return session.abort(); });
}

Result<std::optional<double>> GenicamCamera::temperature_c() {
  return keeper_->ask<std::optional<double>>([](Session& session) { return session.temperature_c(); });
}

}  // namespace rig::drivers::aravis
