#include "calibration/hdr_merge.h"

#include <algorithm>

#include "core/base/parallel.h"

namespace rig::calibration {

namespace {

// Fixed-point steps from the photon-limited start; the third changes the result by less than 1e-4 sigma.
constexpr int kIterations = 2;
constexpr std::size_t kGrainPixels = 65536;

// What is the same for every pixel of one exposure.
struct Step {
  const std::uint16_t* samples;
  float scale;     // signal in digital numbers for a radiance of one
  float photon;    // variance a unit of signal
  float constant;  // variance without signal
};

}  // namespace

RadianceImage merge_exposures(std::span<const Exposure> exposures, int width,
                              const geometry::SensorModel& sensor, const PixelRect& rect) {
  std::vector<Step> steps;
  for (const Exposure& exposure : exposures) {
    geometry::SensorModel at_gain = sensor;
    at_gain.electrons_per_dn /= exposure.gain;
    const double constant = at_gain.variance_dn2(0);
    steps.push_back({exposure.samples, static_cast<float>(exposure.exposure_s * exposure.gain),
                     static_cast<float>(at_gain.variance_dn2(1) - constant), static_cast<float>(constant)});
  }
  // The least exposure first: where it is saturated, all are.
  std::sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.scale < b.scale; });

  RadianceImage image;
  image.rect = rect;
  const std::size_t count = static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  image.value.resize(count);
  image.variance.resize(count);
  image.saturated.resize(count);
  const auto black = static_cast<float>(sensor.black_dn);
  const auto saturation = static_cast<float>(sensor.saturation_dn);

  const auto merge_row = [&](int row, std::vector<float>& signal) {
    const std::size_t source = static_cast<std::size_t>(rect.y + row) * static_cast<std::size_t>(width) +
                               static_cast<std::size_t>(rect.x);
    const std::size_t target = static_cast<std::size_t>(row) * static_cast<std::size_t>(rect.width);
    for (std::size_t i = 0; i < static_cast<std::size_t>(rect.width); ++i) {
      float sum_signal = 0, sum_scale = 0;
      std::size_t used = 0;
      for (; used < steps.size(); ++used) {
        const auto sample = static_cast<float>(steps[used].samples[source + i]);
        if (sample >= saturation) break;
        signal[used] = sample - black;
        sum_signal += signal[used];
        sum_scale += steps[used].scale;
      }
      if (used == 0) {
        const Step& least = steps.front();
        const float bound = saturation - black;
        image.value[target + i] = bound / least.scale;
        image.variance[target + i] = (least.constant + least.photon * bound) / (least.scale * least.scale);
        image.saturated[target + i] = 1;
        continue;
      }
      float estimate = sum_signal / sum_scale;
      float information = 0;
      for (int iteration = 0; iteration <= kIterations; ++iteration) {
        float weighted = 0;
        information = 0;
        const float light = std::max(estimate, 0.0F);
        for (std::size_t k = 0; k < used; ++k) {
          const Step& step = steps[k];
          const float weight = step.scale / (step.constant + step.photon * step.scale * light);
          weighted += weight * signal[k];
          information += weight * step.scale;
        }
        // The last round only brings the variance up to date with the estimate.
        if (iteration < kIterations) estimate = weighted / information;
      }
      image.value[target + i] = estimate;
      image.variance[target + i] = 1 / information;
    }
  };
  const std::size_t grain =
      std::max<std::size_t>(1, kGrainPixels / static_cast<std::size_t>(std::max(rect.width, 1)));
  base::parallel_for(static_cast<std::size_t>(rect.height), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<float> signal(steps.size());
    for (std::size_t row = begin; row < end; ++row) merge_row(static_cast<int>(row), signal);
  });
  return image;
}

}  // namespace rig::calibration
