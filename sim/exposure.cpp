#include "sim/exposure.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/base/random.h"

namespace rig::sim {

namespace {

// Knuth's method; only for small means, where the normal approximation fails.
double small_poisson(double mean, base::Random& random) {
  const double limit = std::exp(-mean);
  double product = random.uniform();
  int n = 0;
  while (product > limit) {
    product *= random.uniform();
    ++n;
  }
  return n;
}

}  // namespace

void expose(const CameraWorld& camera, const std::vector<float>& electrons_per_s, double exposure_s,
            double gain, std::uint64_t key, std::span<std::uint16_t> out) {
  constexpr double kSmall = 12;
  const double per_electron = gain / camera.electrons_per_dn;
  base::parallel_for(out.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double mean = static_cast<double>(electrons_per_s[i]) * exposure_s;
      base::Random random(base::derive_key(key, i));
      // One Box-Muller pair serves both kinds of noise.
      const double radius = std::sqrt(-2.0 * std::log1p(-random.uniform()));
      const double angle = 2 * kPi * random.uniform();
      const double photons = mean < kSmall ? small_poisson(mean, random)
                                           : std::max(0.0, mean + std::sqrt(mean) * radius * std::cos(angle));
      const double electrons = photons + camera.read_noise_e * radius * std::sin(angle);
      const double dn = camera.black_dn + electrons * per_electron;
      out[i] = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, camera.saturation_dn)));
    }
  });
}

}  // namespace rig::sim
