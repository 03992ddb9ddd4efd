#include "daemon/exposure_strategy.h"

namespace rig::daemon {

NextExposure next_exposure(const machine::ExposureConfig& config, std::size_t triggered,
                           const std::vector<scan::FrameRecord>& fetched) {
  using Kind = NextExposure::Kind;
  if (config.strategy == machine::ExposureStrategy::fixed) {
    if (triggered >= config.exposures_s.size()) return {Kind::complete, 0, true};
    return {Kind::expose, config.exposures_s[triggered], triggered + 1 == config.exposures_s.size()};
  }
  const auto most = static_cast<std::size_t>(config.most_frames);
  if (triggered == 0) return {Kind::expose, config.longest_s, most == 1};
  if (fetched.size() < triggered) return {Kind::wait_for_frame, 0, false};
  if (triggered >= most || fetched.back().saturated_share <= config.saturated_share)
    return {Kind::complete, 0, true};
  return {Kind::expose, config.longest_s / static_cast<double>(1ULL << triggered), triggered + 1 == most};
}

}  // namespace rig::daemon
