#include "daemon/exposure_strategy.h"

#include <algorithm>

#include "core/machine/exposure_prediction.h"
#include "daemon/adaptive_exposure.h"

namespace rig::daemon {

namespace {

using Kind = NextExposure::Kind;
using machine::ExposureStrategy;

constexpr NextExposure kWait{Kind::wait_for_frame, 0, false};
constexpr NextExposure kComplete{Kind::complete, 0, true};

NextExposure from_list(const std::vector<double>& bracket, std::size_t triggered) {
  if (triggered >= bracket.size()) return kComplete;
  return {Kind::expose, bracket[triggered], triggered + 1 == bracket.size()};
}

NextExposure halved(const machine::ExposureConfig& config, const PoseTake& take) {
  const auto most = static_cast<std::size_t>(config.most_frames);
  if (take.triggered == 0) return {Kind::expose, config.longest_s, most == 1};
  if (take.frames.size() < take.triggered) return kWait;
  if (take.triggered >= most || take.frames.back().saturated_share <= config.saturated_share)
    return kComplete;
  return {Kind::expose, config.longest_s / static_cast<double>(1ULL << take.triggered),
          take.triggered + 1 == most};
}

std::vector<SeenFrame> seen(const PoseTake& take) {
  std::vector<SeenFrame> frames;
  for (std::size_t i = 0; i < take.frames.size(); ++i) {
    frames.push_back({take.frames[i].exposure_s, i < take.histograms.size() ? take.histograms[i] : nullptr});
  }
  return frames;
}

NextExposure adapted(const Setup& setup, const machine::ExposureConfig& config, const PoseTake& take) {
  const auto most = static_cast<std::size_t>(config.most_frames);
  if (take.triggered == 0) return {Kind::expose, config.first_s, most == 1};
  if (take.frames.size() < take.triggered) return kWait;
  if (take.triggered >= most) return kComplete;
  AdaptiveRequest request;
  request.sensor = setup.rig.camera.sensor;
  request.longest_s = config.longest_s;
  request.shortest_s = std::min(setup.rig.camera.min_exposure_s, config.longest_s);
  request.readout_s = setup.camera.readout_s;
  request.frames_left = most - take.triggered;
  request.snr = config.snr;
  request.short_share = config.short_share;
  const auto next = next_adaptive_s(request, seen(take));
  if (!next) return kComplete;
  return {Kind::expose, *next, take.triggered + 1 == most};
}

}  // namespace

NextExposure next_exposure(const Setup& setup, const machine::ExposureConfig& config, const PoseTake& take) {
  switch (config.strategy) {
    case ExposureStrategy::fixed:
      return from_list(config.exposures_s, take.triggered);
    case ExposureStrategy::halve:
      return halved(config, take);
    case ExposureStrategy::predicted:
      return from_list(
          machine::predicted_bracket_s(config, machine::mirror_angle_rad(setup.rig, take.target_rad)),
          take.triggered);
    case ExposureStrategy::adaptive:
      return adapted(setup, config, take);
  }
  return kComplete;
}

std::optional<double> shortfall(const Setup& setup, const machine::ExposureConfig& config,
                                const PoseTake& take) {
  if (config.strategy != ExposureStrategy::adaptive) return std::nullopt;
  const auto frames = seen(take);
  std::vector<double> exposures;
  for (const SeenFrame& frame : frames) exposures.push_back(frame.exposure_s);
  const auto& sensor = setup.rig.camera.sensor;
  return share_short(sensor, config.snr, scene_of(sensor, frames), exposures);
}

}  // namespace rig::daemon
