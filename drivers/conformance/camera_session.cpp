#include "drivers/conformance/camera_session.h"

#include <algorithm>
#include <cmath>

namespace rig::drivers::conformance {

using base::seconds;

namespace {

CameraUnderTest camera_of(Bench& bench) {
  auto test = bench.camera();
  if (!test) does_not_concern("no camera");
  require(test->peer != nullptr && test->exposures_s.size() == 8,
          "the bench does not say what its camera is to expose");
  auto sorted = test->exposures_s;
  std::sort(sorted.begin(), sorted.end());
  require(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
          "the bench's exposures do not differ");
  return *test;
}

std::size_t frame_size(const CameraCapabilities& capabilities) {
  require(capabilities.width > 0 && capabilities.height > 0, "frames are {} x {} pixels", capabilities.width,
          capabilities.height);
  return static_cast<std::size_t>(capabilities.width) * static_cast<std::size_t>(capabilities.height);
}

}  // namespace

std::size_t GuardedFrame::touched() const {
  const auto begin = words_.begin();
  const auto end = words_.end();
  constexpr auto kRoom = static_cast<std::ptrdiff_t>(kGuard);
  const auto wrong = [](std::uint16_t word) { return word != kCanary; };
  return static_cast<std::size_t>(std::count_if(begin, begin + kRoom, wrong) +
                                  std::count_if(end - kRoom, end, wrong));
}

CameraSession::CameraSession(Bench& bench)
    : bench_(bench),
      test_(camera_of(bench)),
      waiting_(bench.clock()),
      opened_(bench, test_.device),
      capabilities_(camera().capabilities()),
      frame_(frame_size(capabilities_)) {}

double CameraSession::longest_s() const {
  return *std::max_element(test_.exposures_s.begin(), test_.exposures_s.end());
}

double CameraSession::shortest_s() const {
  return *std::min_element(test_.exposures_s.begin(), test_.exposures_s.end());
}

std::size_t CameraSession::size() const {
  return frame_.pixels().size();
}

Result<void> CameraSession::try_arm() {
  return timed(clock(), kCameraCall, "arm", [&] { return camera().arm(); });
}

Result<void> CameraSession::try_trigger(double exposure_s) {
  return timed(clock(), kCameraCall, "trigger", [&] { return camera().trigger(exposure_s, test_.gain); });
}

Result<std::optional<FrameInfo>> CameraSession::try_fetch(std::span<std::uint16_t> pixels) {
  auto answer = timed(clock(), kFrameCall, "fetch", [&] { return camera().fetch(pixels); });
  require_always(frame_.touched() == 0, "fetch wrote {} words outside the buffer that it was given",
                 frame_.touched());
  return answer;
}

Result<void> CameraSession::try_abort() {
  return timed(clock(), kCameraCall, "abort", [&] { return camera().abort(); });
}

void CameraSession::end_while_exposing(End end, double exposure_s) {
  if (end == End::killed) {
    opened_.start_victim(ExposeTask{exposure_s, test_.gain})->kill();
    return;
  }
  arm();
  trigger(exposure_s);
  close();
}

FrameInfo CameraSession::wait_for_frame(double exposure_s) {
  std::optional<FrameInfo> info;
  const bool came = waiting_.until(
      [&] {
        info = must(try_fetch(frame_.pixels()), fmt::format("fetch of {} s", exposure_s));
        return info.has_value();
      },
      seconds(exposure_s) + test_.frame_within);
  require(came, "no frame of {} s within {:.3f} s", exposure_s,
          exposure_s + base::to_seconds(test_.frame_within));
  return *info;
}

FrameInfo CameraSession::take(double exposure_s) {
  const base::Time triggered = waiting_.now();
  trigger(exposure_s);
  const FrameInfo info = wait_for_frame(exposure_s);
  require_own(info, exposure_s, triggered);
  return info;
}

void CameraSession::require_own(const FrameInfo& info, double exposure_s, base::Time triggered) {
  // A camera stamps by its own clock, which follows ours no closer than this.
  constexpr base::Duration kStampRoom = std::chrono::milliseconds(50);
  require_always(std::abs(info.exposure_s - exposure_s) <= test_.tolerance * exposure_s,
                 "asked for {} s, the frame says {} s", exposure_s, info.exposure_s);
  require(info.gain > 0 && std::isfinite(info.gain), "the frame says that its gain is {}", info.gain);
  require(info.started >= triggered - kStampRoom, "the frame began {:.3f} s before it was triggered",
          base::to_seconds(triggered - info.started));
  require(info.started <= waiting_.now() + kStampRoom, "the frame began {:.3f} s after it was there",
          base::to_seconds(info.started - waiting_.now()));
  const auto proven = peer().exposure_in(frame_.pixels());
  if (!proven) return;
  pixels_told_ = true;
  require_always(std::abs(*proven - exposure_s) <= test_.tolerance * exposure_s,
                 "asked for {} s, the frame says {} s, and its pixels were exposed for {} s", exposure_s,
                 info.exposure_s, *proven);
}

std::optional<base::Error> CameraSession::require_none(double exposure_s, std::string_view when) {
  std::optional<base::Error> first;
  const bool came = waiting_.until(
      [&] {
        const auto answer = try_fetch(frame_.pixels());
        if (!answer && !first) first = answer.error();
        return answer && answer->has_value();
      },
      seconds(exposure_s) + test_.frame_within);
  require_always(!came, "{}: a frame was delivered", when);
  return first;
}

Outcome CameraSession::proven_by_pixels() const {
  if (pixels_told_) return {};
  return {Verdict::not_proven, "as reported it is so; this device paints no exposure into its pixels"};
}

}  // namespace rig::drivers::conformance
