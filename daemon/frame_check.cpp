#include "daemon/frame_check.h"

#include <algorithm>
#include <cmath>

#include "daemon/job.h"
#include "daemon/messages.h"
#include "daemon/safety.h"
#include "daemon/visit.h"

namespace rig::daemon {

namespace {

// A camera rounds to its line times; what is further off is another exposure.
constexpr double kExposureFactor = 2;
// Black this many standard deviations of the read noise above zero gives no line of zeros.
constexpr double kSurely = 10;

}  // namespace

std::string damage_in(const machine::CameraConfig& camera, std::span<const std::uint16_t> pixels) {
  const auto width = static_cast<std::size_t>(camera.intrinsics.width);
  const auto& sensor = camera.sensor;
  const unsigned most = (1U << static_cast<unsigned>(sensor.bits)) - 1;
  // One pass without branches: every sample of every frame goes through here.
  unsigned seen = 0;
  for (const std::uint16_t sample : pixels) seen |= sample;
  if (seen > most) {
    const auto at = std::find_if(pixels.begin(), pixels.end(), [&](std::uint16_t v) { return v > most; });
    const auto index = static_cast<std::size_t>(at - pixels.begin());
    return fmt::format("pixel ({}, {}) is {}, beyond the {} bits of the sensor", index % width, index / width,
                       *at, sensor.bits);
  }
  if (sensor.black_dn < 1 + kSurely * sensor.read_noise_e / sensor.electrons_per_dn) return {};
  for (std::size_t from = 0; from + width <= pixels.size(); from += width) {
    if (pixels[from] != 0) continue;
    const auto line = pixels.subspan(from, width);
    if (std::all_of(line.begin(), line.end(), [](std::uint16_t v) { return v == 0; })) {
      return fmt::format("line {} is all zeros, below the black level of the sensor", from / width);
    }
  }
  return {};
}

std::string why_refused(const State& state, const PendingFrame& pending, const FrameFetched& fetched) {
  if (!fetched.damage.empty()) return fetched.damage;
  const double did_s = fetched.info.exposure_s;
  if (!std::isfinite(did_s) || did_s <= 0 || !std::isfinite(fetched.info.gain)) {
    return "the camera does not say how it exposed";
  }
  if (did_s > kExposureFactor * pending.exposure_s || did_s * kExposureFactor < pending.exposure_s) {
    return fmt::format("the camera exposed for {} us, asked for were {} us", did_s * 1e6,
                       pending.exposure_s * 1e6);
  }
  if (state.last_frame && *state.last_frame == fetched.info.counter) {
    return fmt::format("frame {} of the camera came a second time", fetched.info.counter);
  }
  return {};
}

void refuse_frame(const Setup& setup, State& state, Actions& actions, const std::string& reason) {
  const PendingFrame pending = *state.frame;
  if (++state.frames_refused >= kRefusedInARow) {
    state.frames_refused = 0;
    stop_everything(
        setup, state, actions,
        fmt::format("{} frames one after the other were no good, the last one: {}", kRefusedInARow, reason));
    return;
  }
  state.frame.reset();
  actions.push_back(AbortCamera{});
  if (state.snap && pending.row == kSnapRow) {
    actions.push_back(SendReply{state.snap->asker.client,
                                make_reply(state.snap->asker.id, protocol::FAILED, "the frame: " + reason)});
    state.snap.reset();
  }
  if (pending.row == kVisitRow) on_visit_frame_refused(state, actions, "a frame: " + reason);
  if (pending.row >= 0 && state.job) on_job_frame_refused(state, actions, pending, "a frame: " + reason);
}

}  // namespace rig::daemon
