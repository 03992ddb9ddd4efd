// Which exposure brings the pixels of the sample to a signal-to-noise ratio in the least time.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/geometry/sensor.h"
#include "daemon/sample_histogram.h"

namespace rig::daemon {

/// One frame of the bracket.
struct SeenFrame {
  double exposure_s = 0;
  std::shared_ptr<const SampleHistogram> histogram;  ///< none: nothing of the sample was in view
};

struct AdaptiveRequest {
  geometry::SensorModel sensor;
  double shortest_s = 0, longest_s = 0;  ///< that may be taken
  double readout_s = 0;                  ///< that every further frame costs
  std::size_t frames_left = 0;
  double snr = 1;
  double short_share = 0;  ///< of the pixels that may miss it
};

/// Pixels of like brightness.
struct Brightness {
  double low_dn_s = 0, high_dn_s = 0;  ///< signal above black per second of exposure
  double share = 0;                    ///< of all pixels
};

/// How bright the pixels are: where the longest exposure is not saturated as that shows it, the brighter ones
/// as the next shorter one does, and so on, colour by colour and rank by rank.
struct Scene {
  std::vector<Brightness> known;
  double saturated_share = 0;  ///< saturated in every frame
};
[[nodiscard]] Scene scene_of(const geometry::SensorModel& sensor, const std::vector<SeenFrame>& frames);

/// The signal-to-noise ratio of the merge of these exposures, each weighted by its inverse variance, for a
/// pixel of that brightness; exposures in which it comes within three standard deviations of saturation do
/// not count.
[[nodiscard]] double merged_snr(const geometry::SensorModel& sensor, const Brightness& pixel,
                                const std::vector<double>& exposures_s);

/// Share of the pixels that miss the ratio: too dark for these frames, or saturated in all of them.
[[nodiscard]] double share_short(const geometry::SensorModel& sensor, double snr, const Scene& scene,
                                 const std::vector<double>& exposures_s);

/// The next exposure of the bracket; nothing where enough pixels reach the ratio, no frame is left, or no
/// further frame would help. While more pixels than may miss it are saturated in every frame, shorter
/// exposures come first, in steps that reach the shortest with the last frame. Else the exposures still
/// needed are chosen together, one or two different ones in steps of a quarter stop with any number of
/// repeats: those that do with the least time, or, where none do, those that leave the fewest pixels short.
/// The longest of them is next.
[[nodiscard]] std::optional<double> next_adaptive_s(const AdaptiveRequest& request,
                                                    const std::vector<SeenFrame>& frames);

}  // namespace rig::daemon
