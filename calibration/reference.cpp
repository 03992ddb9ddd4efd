#include "calibration/reference.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calibration/projection.h"
#include "calibration/reflectance.h"
#include "core/base/units.h"

namespace rig::calibration {

namespace {

using geometry::Vec3;

constexpr double kInnerShare = 0.8;       // of a patch's edges: the rest mixes with what lies beside it
constexpr std::size_t kLeastPixels = 25;  // of each colour
// A patch is left out if it is off by this share and by this multiple of the usual scatter.
constexpr double kLeastOutlier = 0.03;
constexpr double kOutlierSigmas = 5;
// A pose is listed likewise.
constexpr double kLeastOddPose = 0.02;
constexpr double kOddPoseSigmas = 3;
constexpr std::size_t kTauSteps = 200;    // of the grid over the light's standard deviation
constexpr double kVarianceFloor = 1e-10;  // relative variance; a part in 1e5 is nobody's patch

std::array<Vec3, 4> inner_corners(const machine::Patch& patch) {
  const double w = 0.5 * kInnerShare * patch.width_m, h = 0.5 * kInnerShare * patch.height_m;
  return {Vec3{patch.x_m - w, patch.y_m - h, 0}, Vec3{patch.x_m + w, patch.y_m - h, 0},
          Vec3{patch.x_m + w, patch.y_m + h, 0}, Vec3{patch.x_m - w, patch.y_m + h, 0}};
}

// Bounding box of the patch's inner part in the image, whether or not it is inside it.
std::optional<PixelRect> inner_box(const geometry::CameraIntrinsics& camera,
                                   const geometry::RigidTransform& camera_from_sample,
                                   const machine::Patch& patch) {
  double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
  for (const Vec3 corner : inner_corners(patch)) {
    const auto pixel = geometry::project(camera, camera_from_sample.point(corner));
    if (!pixel || std::abs(pixel->x) > 1e6 || std::abs(pixel->y) > 1e6) return std::nullopt;
    x0 = std::min(x0, pixel->x), x1 = std::max(x1, pixel->x);
    y0 = std::min(y0, pixel->y), y1 = std::max(y1, pixel->y);
  }
  const int left = static_cast<int>(std::floor(x0)), top = static_cast<int>(std::floor(y0));
  return PixelRect{left, top, static_cast<int>(std::ceil(x1)) - left + 1,
                   static_cast<int>(std::ceil(y1)) - top + 1};
}

PixelRect whole_image(const geometry::CameraIntrinsics& camera) {
  return {0, 0, camera.width, camera.height};
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double log_of_all(const PatchReading& reading) {
  return (std::log(reading.intensity[0]) + std::log(reading.intensity[1]) + std::log(reading.intensity[2])) /
         3;
}

// Drops patches that contradict their pose, or the scan where a pose has too few to judge by.
std::vector<std::vector<PatchReading>> without_outliers(
    const std::vector<std::vector<PatchReading>>& readings, std::vector<Disagreement>* disagreements) {
  std::vector<double> all;
  for (const auto& pose : readings) {
    for (const PatchReading& reading : pose) all.push_back(log_of_all(reading));
  }
  const double overall = median(all);
  std::vector<std::vector<double>> deviation(readings.size());
  std::vector<double> absolute;
  for (std::size_t p = 0; p < readings.size(); ++p) {
    std::vector<double> logs;
    for (const PatchReading& reading : readings[p]) logs.push_back(log_of_all(reading));
    const double centre = logs.size() >= 3 ? median(logs) : overall;
    for (const double x : logs) {
      deviation[p].push_back(x - centre);
      absolute.push_back(std::abs(x - centre));
    }
  }
  const double usual = 1.4826 * median(absolute);
  const double limit = std::max(kLeastOutlier, kOutlierSigmas * usual);
  std::vector<std::vector<PatchReading>> kept(readings.size());
  for (std::size_t p = 0; p < readings.size(); ++p) {
    for (std::size_t i = 0; i < readings[p].size(); ++i) {
      if (std::abs(deviation[p][i]) > limit && readings[p].size() >= 3) {
        disagreements->push_back({p, static_cast<int>(readings[p][i].patch), std::expm1(deviation[p][i])});
      } else {
        kept[p].push_back(readings[p][i]);
      }
    }
  }
  return kept;
}

// One colour of all poses.
struct PoseMean {
  std::size_t pose = 0;
  double mean = 0, count = 0;
};

struct RandomEffects {
  double mu = 0, within = 0, between = 0;  // mean of the logarithms, both variances
  std::vector<double> effect, variance;    // a pose each: expected d_p, variance of mu + d_p
};

// What follows once the variance between poses is given.
struct Given {
  double tau2 = 0, mu = 0, mu_variance = 0;
};

// The likelihood of tau has mu integrated out.
Given given_tau(const std::vector<PoseMean>& means, double within, double tau, double* log_likelihood) {
  Given out;
  out.tau2 = tau * tau;
  double weights = 0, log_weights = 0;
  for (const PoseMean& m : means) {
    const double w = 1 / (out.tau2 + within / m.count);
    weights += w;
    log_weights += std::log(w);
    out.mu += w * m.mean;
  }
  out.mu /= weights;
  out.mu_variance = 1 / weights;
  double squares = 0;
  for (const PoseMean& m : means)
    squares += (m.mean - out.mu) * (m.mean - out.mu) / (out.tau2 + within / m.count);
  *log_likelihood = 0.5 * (log_weights - std::log(weights) - squares);
  return out;
}

RandomEffects random_effects(const std::vector<std::vector<PatchReading>>& readings, std::size_t colour) {
  RandomEffects out;
  std::vector<PoseMean> means;
  double squares = 0, freedom = 0, noise = 0, count = 0;
  for (std::size_t p = 0; p < readings.size(); ++p) {
    if (readings[p].empty()) continue;
    PoseMean mean{p, 0, static_cast<double>(readings[p].size())};
    for (const PatchReading& reading : readings[p]) {
      mean.mean += std::log(reading.intensity[colour]) / mean.count;
      const double relative = reading.sigma[colour] / reading.intensity[colour];
      noise += relative * relative;
      count += 1;
    }
    for (const PatchReading& reading : readings[p]) {
      const double d = std::log(reading.intensity[colour]) - mean.mean;
      squares += d * d;
    }
    freedom += mean.count - 1;
    means.push_back(mean);
  }
  // With one patch a pose their scatter is unknown; then only their noise is.
  out.within = std::max({freedom > 0 ? squares / freedom : 0.0, noise / count, kVarianceFloor});

  // Over the standard deviation tau between poses, uniform a priori, the posterior on a grid: given tau all
  // is in closed form, and means and variances over tau follow from it.
  double low = means[0].mean, high = low;
  for (const PoseMean& m : means) low = std::min(low, m.mean), high = std::max(high, m.mean);
  const double most_tau = 2 * (high - low) + 1e-9;
  std::vector<double> log_posterior(kTauSteps);
  std::vector<Given> given(kTauSteps);
  for (std::size_t i = 0; i < kTauSteps; ++i) {
    given[i] = given_tau(means, out.within, most_tau * static_cast<double>(i) / kTauSteps, &log_posterior[i]);
  }
  const double best = *std::max_element(log_posterior.begin(), log_posterior.end());
  double total = 0;
  for (double& p : log_posterior) total += p = std::exp(p - best);

  out.effect.assign(readings.size(), 0.0);
  out.variance.assign(readings.size(), 0.0);
  std::vector<double> square(readings.size(), 0.0), place(readings.size(), 0.0);
  for (std::size_t i = 0; i < kTauSteps; ++i) {
    const Given& g = given[i];
    const double probability = log_posterior[i] / total;
    out.mu += probability * g.mu;
    out.between += probability * g.tau2;
    std::vector<double> share(readings.size(), 0.0), mean(readings.size(), g.mu), own(readings.size(), 0.0);
    for (const PoseMean& m : means) {
      share[m.pose] = g.tau2 / (g.tau2 + out.within / m.count);
      mean[m.pose] = m.mean;
      own[m.pose] = out.within / m.count;
    }
    for (std::size_t p = 0; p < readings.size(); ++p) {
      const double at = g.mu + share[p] * (mean[p] - g.mu);
      const double without = own[p] > 0 ? share[p] * own[p] : g.tau2;
      const double variance = without + (1 - share[p]) * (1 - share[p]) * g.mu_variance;
      place[p] += probability * at;
      square[p] += probability * (at * at + variance);
    }
  }
  for (std::size_t p = 0; p < readings.size(); ++p) {
    out.effect[p] = place[p] - out.mu;
    out.variance[p] = std::max(square[p] - place[p] * place[p], 0.0);
  }
  return out;
}

}  // namespace

PixelRect pixels_of_patch(const geometry::CameraIntrinsics& camera,
                          const geometry::RigidTransform& camera_from_sample, const machine::Patch& patch) {
  const auto box = inner_box(camera, camera_from_sample, patch);
  if (!box || !whole_image(camera).contains(*box)) return {};
  return *box;
}

base::Result<PatchReading> measure_patch(const RadianceImage& image, const machine::CameraConfig& camera,
                                         const geometry::RigidTransform& camera_from_sample, Vec3 light_m,
                                         const machine::Patch& patch, std::size_t index) {
  const auto where = fmt::format("patch {}", index + 1);
  const auto refuse = [&](std::string why) {
    return base::fail(base::ErrorCode::bad_input, std::move(why), where);
  };
  const PixelRect box = pixels_of_patch(camera.intrinsics, camera_from_sample, patch);
  if (box.width == 0 || !image.rect.contains(box)) return refuse("is not wholly in the image");
  if (geometry::inverse(camera_from_sample).translation.z <= 0) return refuse("is seen from behind");

  const double half_width = 0.5 * kInnerShare * patch.width_m,
               half_height = 0.5 * kInnerShare * patch.height_m;
  std::array<std::size_t, 3> count{};
  Rgb signal{}, variance{}, expected{};
  for (int y = box.y; y < box.y + box.height; ++y) {
    for (int x = box.x; x < box.x + box.width; ++x) {
      const auto point = geometry::intersect_plane(camera.intrinsics, camera_from_sample,
                                                   {static_cast<double>(x), static_cast<double>(y)});
      if (!point || std::abs(point->x - patch.x_m) > half_width ||
          std::abs(point->y - patch.y_m) > half_height) {
        continue;
      }
      const std::size_t pixel = image.index(x, y);
      if (image.saturated[pixel] != 0) return refuse("is saturated in every exposure");
      const auto colour = static_cast<std::size_t>(geometry::colour_at(camera.bayer, x, y));
      ++count[colour];
      signal[colour] += static_cast<double>(image.value[pixel]);
      variance[colour] += static_cast<double>(image.variance[pixel]);
      expected[colour] += patch.reflectance / base::kPi * irradiance_per_intensity(light_m, *point);
    }
  }
  if (camera.bayer == geometry::BayerPattern::none) {
    count.fill(count[1]), signal.fill(signal[1]), variance.fill(variance[1]), expected.fill(expected[1]);
  }
  PatchReading reading;
  reading.patch = index;
  for (std::size_t c = 0; c < 3; ++c) {
    if (count[c] < kLeastPixels) return refuse(fmt::format("shows only {} pixels of a colour", count[c]));
    if (expected[c] <= 0) return refuse("is not lit");
    if (signal[c] <= 0) return refuse("is black");
    reading.intensity[c] = signal[c] / expected[c];
    reading.sigma[c] = std::sqrt(variance[c]) / expected[c];
  }
  return reading;
}

base::Result<LightScale> pool_readings(const std::vector<std::vector<PatchReading>>& readings) {
  if (std::all_of(readings.begin(), readings.end(), [](const auto& pose) { return pose.empty(); })) {
    return base::fail(base::ErrorCode::bad_input, "no pose shows a reference patch");
  }
  LightScale scale;
  scale.intensity.resize(readings.size());
  scale.relative_sigma.resize(readings.size());
  const auto kept = without_outliers(readings, &scale.disagreements);
  std::vector<double> odd(readings.size(), 0.0);
  double pose_sigma = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const RandomEffects effects = random_effects(kept, c);
    scale.mean[c] = std::exp(effects.mu);
    scale.between_poses[c] = std::sqrt(effects.between);
    scale.between_patches[c] = std::sqrt(effects.within);
    pose_sigma = std::max(pose_sigma, std::sqrt(effects.between));
    for (std::size_t p = 0; p < readings.size(); ++p) {
      scale.intensity[p][c] = std::exp(effects.mu + effects.effect[p]);
      scale.relative_sigma[p][c] = std::sqrt(effects.variance[p]);
      if (std::abs(effects.effect[p]) > std::abs(odd[p])) odd[p] = effects.effect[p];
    }
  }
  for (std::size_t p = 0; p < readings.size(); ++p) {
    if (std::abs(odd[p]) > std::max(kLeastOddPose, kOddPoseSigmas * pose_sigma)) {
      scale.disagreements.push_back({p, -1, std::expm1(odd[p])});
    }
  }
  return scale;
}

}  // namespace rig::calibration
