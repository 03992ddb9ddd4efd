#include "daemon/adaptive_exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace rig::daemon {

using geometry::SensorModel;

namespace {

constexpr double kClassesPerOctave = 8;
constexpr double kStepsPerOctave = 4;
constexpr double kFewestSteps_s = 1e-9;  // below which two exposures are the same
constexpr double kSaturationMargin = 3;  // standard deviations
constexpr double kRounding = 1e-12;      // of shares
constexpr double kLeastShortening = 4;   // from a frame that shows too little, where more than one is left

double signal_at_saturation(const SensorModel& sensor) {
  return sensor.saturation_dn - sensor.black_dn;
}

// The largest mean signal that the noise does not take into saturation.
double usable_signal(const SensorModel& sensor) {
  const double full = signal_at_saturation(sensor);
  return full - kSaturationMargin * std::sqrt(sensor.variance_dn2(full));
}

// What one exposure adds to the square of the merged signal-to-noise ratio.
double squared_snr(const SensorModel& sensor, const Brightness& pixel, double exposure_s) {
  if (pixel.high_dn_s * exposure_s > usable_signal(sensor)) return 0;
  const double signal = pixel.low_dn_s * exposure_s;
  return signal * signal / sensor.variance_dn2(signal);
}

// Pixels of the same octave's part are one class.
class Classes {
 public:
  void add(double dn_s, double share) {
    const int key = static_cast<int>(std::floor(kClassesPerOctave * std::log2(dn_s)));
    const auto [found, fresh] = classes_.try_emplace(key, Brightness{dn_s, dn_s, 0});
    Brightness& b = found->second;
    b.low_dn_s = std::min(b.low_dn_s, dn_s);
    b.high_dn_s = std::max(b.high_dn_s, dn_s);
    b.share += share;
  }
  [[nodiscard]] std::vector<Brightness> list() const {
    std::vector<Brightness> out;
    for (const auto& [key, brightness] : classes_) out.push_back(brightness);
    return out;
  }

 private:
  std::map<int, Brightness> classes_;
};

std::vector<double> exposures_of(const std::vector<SeenFrame>& frames) {
  std::vector<double> out;
  for (const SeenFrame& frame : frames) out.push_back(frame.exposure_s);
  return out;
}

std::vector<double> grid(const AdaptiveRequest& request) {
  std::vector<double> out;
  for (int k = 0;; ++k) {
    const double s = request.longest_s * std::exp2(-k / kStepsPerOctave);
    if (s < request.shortest_s + kFewestSteps_s) break;
    out.push_back(s);
  }
  out.push_back(request.shortest_s);
  return out;
}

struct Choice {
  double short_share = std::numeric_limits<double>::infinity();
  double seconds = std::numeric_limits<double>::infinity();
  double longest_s = 0;
};

// Enough pixels before the least time; without enough, the fewest short.
bool better(const Choice& a, const Choice& b, double allowed) {
  const bool a_does = a.short_share <= allowed;
  const bool b_does = b.short_share <= allowed;
  if (a_does != b_does) return a_does;
  if (!a_does && std::abs(a.short_share - b.short_share) > kRounding) return a.short_share < b.short_share;
  return a.seconds < b.seconds;
}

Choice best_choice(const AdaptiveRequest& request, const Scene& scene, const std::vector<double>& taken,
                   double allowed) {
  const std::vector<double> exposures = grid(request);
  const std::size_t classes = scene.known.size();
  const double wanted = request.snr * request.snr;
  std::vector<double> before(classes, 0);
  std::vector<std::vector<double>> adds(exposures.size(), std::vector<double>(classes));
  for (std::size_t c = 0; c < classes; ++c) {
    for (const double s : taken) before[c] += squared_snr(request.sensor, scene.known[c], s);
    for (std::size_t e = 0; e < exposures.size(); ++e) {
      adds[e][c] = squared_snr(request.sensor, scene.known[c], exposures[e]);
    }
  }
  Choice best;
  const auto consider = [&](std::size_t a, std::size_t times_a, std::size_t b, std::size_t times_b) {
    const auto na = static_cast<double>(times_a);
    const auto nb = static_cast<double>(times_b);
    Choice choice;
    choice.seconds = na * exposures[a] + nb * exposures[b] + (na + nb) * request.readout_s;
    if (best.short_share <= allowed && choice.seconds >= best.seconds) return;
    choice.short_share = scene.saturated_share;
    for (std::size_t c = 0; c < classes; ++c) {
      if (before[c] + na * adds[a][c] + nb * adds[b][c] < wanted) choice.short_share += scene.known[c].share;
    }
    choice.longest_s = exposures[a];
    if (better(choice, best, allowed)) best = choice;
  };
  for (std::size_t a = 0; a < exposures.size(); ++a) {
    for (std::size_t times = 1; times <= request.frames_left; ++times) {
      consider(a, times, a, 0);
      for (std::size_t b = a + 1; b < exposures.size(); ++b) {
        for (std::size_t more = 1; times + more <= request.frames_left; ++more) consider(a, times, b, more);
      }
    }
  }
  return best;
}

}  // namespace

Scene scene_of(const SensorModel& sensor, const std::vector<SeenFrame>& frames) {
  std::vector<const SeenFrame*> by_length;
  for (const SeenFrame& frame : frames) {
    if (frame.histogram) by_length.push_back(&frame);
  }
  std::stable_sort(by_length.begin(), by_length.end(),
                   [](const SeenFrame* a, const SeenFrame* b) { return a->exposure_s > b->exposure_s; });
  Scene scene;
  if (by_length.empty()) return scene;
  const auto count = [](const std::vector<std::uint32_t>& list) {
    return std::accumulate(list.begin(), list.end(), std::uint64_t{0});
  };
  std::uint64_t all = 0;
  for (const auto& list : by_length.front()->histogram->counts) all += count(list);
  if (all == 0) return scene;
  Classes classes;
  // What hides in the noise is taken for as bright as the noise: a longer exposure will tell.
  const double noise = std::sqrt(sensor.variance_dn2(0));
  for (std::size_t colour = 0; colour < 3; ++colour) {
    // How many of the brightest pixels the longer frames could not tell.
    std::uint64_t unknown = count(by_length.front()->histogram->counts[colour]);
    for (const SeenFrame* frame : by_length) {
      const auto& list = frame->histogram->counts[colour];
      if (list.empty() || unknown == 0) continue;
      std::uint64_t left = unknown;
      const std::uint64_t saturated = std::min<std::uint64_t>(left, list.back());
      left -= saturated;
      for (std::size_t value = list.size() - 1; value > 0 && left > 0; --value) {
        const std::uint64_t here = std::min<std::uint64_t>(left, list[value - 1]);
        left -= here;
        if (here == 0) continue;
        const double signal = static_cast<double>(value - 1) - sensor.black_dn;
        classes.add(std::max(signal, noise) / frame->exposure_s,
                    static_cast<double>(here) / static_cast<double>(all));
      }
      unknown = saturated;
    }
    scene.saturated_share += static_cast<double>(unknown) / static_cast<double>(all);
  }
  scene.known = classes.list();
  return scene;
}

double merged_snr(const SensorModel& sensor, const Brightness& pixel,
                  const std::vector<double>& exposures_s) {
  double square = 0;
  for (const double s : exposures_s) square += squared_snr(sensor, pixel, s);
  return std::sqrt(square);
}

double share_short(const SensorModel& sensor, double snr, const Scene& scene,
                   const std::vector<double>& exposures_s) {
  double share = scene.saturated_share;
  for (const Brightness& pixel : scene.known) {
    if (merged_snr(sensor, pixel, exposures_s) < snr) share += pixel.share;
  }
  return std::min(share, 1.0);
}

std::optional<double> next_adaptive_s(const AdaptiveRequest& request, const std::vector<SeenFrame>& frames) {
  if (request.frames_left == 0) return std::nullopt;
  const Scene scene = scene_of(request.sensor, frames);
  const std::vector<double> taken = exposures_of(frames);
  const double allowed = request.short_share + kRounding;
  const double now = share_short(request.sensor, request.snr, scene, taken);
  if (now <= allowed) return std::nullopt;
  const double shortest = *std::min_element(taken.begin(), taken.end());
  if (scene.saturated_share > allowed && shortest > request.shortest_s + kFewestSteps_s) {
    const double even = std::pow(request.shortest_s / shortest, 1 / static_cast<double>(request.frames_left));
    return std::max(request.shortest_s, shortest * std::min(even, 1 / kLeastShortening));
  }
  const Choice best = best_choice(request, scene, taken, allowed);
  if (best.short_share >= now - kRounding) return std::nullopt;
  return best.longest_s;
}

}  // namespace rig::daemon
