#include "sim/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"
#include "core/base/random.h"

namespace rig::sim {

namespace {

// Below this mean the Poisson distribution is drawn exactly; above, its skewness (1 / sqrt(mean)) hides in
// the read noise and the normal distribution stands for it.
constexpr float kSmallMean = 25;

// Knuth's method (The Art of Computer Programming 2, 3.4.1): its cost grows with the mean.
float small_poisson(double mean, base::Random random) {
  const double limit = std::exp(-mean);
  double product = random.uniform();
  int n = 0;
  while (product > limit) {
    product *= random.uniform();
    ++n;
  }
  return static_cast<float>(n);
}

// Two independent standard normal numbers (Box and Muller 1958) from the halves of one hash.
std::array<float, 2> two_normals(std::uint64_t bits) {
  const auto high = static_cast<float>(static_cast<std::uint32_t>(bits >> 32));
  const auto low = static_cast<float>(static_cast<std::uint32_t>(bits));
  const float radius = std::sqrt(-2.0F * std::log((high + 0.5F) * 0x1p-32F));
  const float angle = 2.0F * static_cast<float>(kPi) * 0x1p-32F * low;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace

void expose(const CameraWorld& camera, std::span<const float> electrons_per_s, double effective_s,
            double gain, std::uint64_t key, std::span<std::uint16_t> out) {
  const auto effective = static_cast<float>(effective_s);
  const auto read_noise = static_cast<float>(camera.read_noise_e);
  const auto per_electron = static_cast<float>(gain / camera.electrons_per_dn);
  const auto black = static_cast<float>(camera.black_dn);
  const auto saturation = static_cast<float>(camera.saturation_dn);
  const auto value = [&](std::size_t i, float normal) {
    const float mean = electrons_per_s[i] * effective;
    float electrons = 0;
    if (mean >= kSmallMean) {
      // The sum of photon and read noise is one normal number.
      electrons = mean + std::sqrt(mean + read_noise * read_noise) * normal;
    } else {
      electrons = read_noise * normal;
      if (mean > 0) electrons += small_poisson(mean, base::Random(base::derive_key(~key, i)));
    }
    const float dn = std::clamp(black + electrons * per_electron, 0.0F, saturation);
    return static_cast<std::uint16_t>(dn + 0.5F);
  };
  const std::size_t pairs = (out.size() + 1) / 2;
  base::parallel_for(pairs, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pair = begin; pair < end; ++pair) {
      const auto normals = two_normals(base::derive_key(key, pair));
      out[2 * pair] = value(2 * pair, normals[0]);
      if (2 * pair + 1 < out.size()) out[2 * pair + 1] = value(2 * pair + 1, normals[1]);
    }
  });
}

}  // namespace rig::sim
