#include "sim/hash_painter.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace rig::sim {

void paint_hashed(const CameraWorld& camera, double effective_s, double gain, std::uint64_t key,
                  std::span<std::uint16_t> out) {
  constexpr double kDark_dn = 3;  // what stands for read noise
  const double full = camera.saturation_dn - camera.black_dn;
  const double filled = std::clamp(effective_s * gain / camera.white_fills_s, 0.0, 1.0);
  const auto range = static_cast<std::uint32_t>(std::clamp(filled * full, kDark_dn, full));
  const auto black = static_cast<std::uint32_t>(camera.black_dn);
  // Four samples from each hash; the product with `range` keeps the high bits.
  std::size_t i = 0;
  for (std::uint64_t word = 0; i < out.size(); ++word) {
    std::uint64_t bits = base::mix64(key + word);
    for (int part = 0; part < 4 && i < out.size(); ++part, ++i, bits >>= 16) {
      out[i] = static_cast<std::uint16_t>(black + (((bits & 0xffff) * range) >> 16));
    }
  }
}

}  // namespace rig::sim
