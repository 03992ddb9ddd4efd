// From a bracket of raw exposures to one image of radiance with its variance: the noise-optimal merge for a
// linear sensor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/sensor.h"

namespace rig::calibration {

/// One exposure of a bracket: raw samples, row-major over the whole image.
struct Exposure {
  const std::uint16_t* samples = nullptr;
  double exposure_s = 0;
  double gain = 1;  ///< analogue gain: digital numbers per electron grow with it
};

/// A rectangle of pixels.
struct PixelRect {
  int x = 0, y = 0;  ///< first pixel
  int width = 0, height = 0;

  [[nodiscard]] bool contains(int px, int py) const {
    return px >= x && py >= y && px < x + width && py < y + height;
  }
  [[nodiscard]] bool contains(const PixelRect& other) const {
    return other.x >= x && other.y >= y && other.x + other.width <= x + width &&
           other.y + other.height <= y + height;
  }
};

/// Part of an image in digital numbers per second at gain 1, above black. Still a mosaic: one colour a pixel.
struct RadianceImage {
  PixelRect rect;                       ///< the part of the image that is here
  std::vector<float> value;             ///< row-major over rect
  std::vector<float> variance;          ///< of value
  std::vector<std::uint8_t> saturated;  ///< 1 where even the least exposure was: value is a lower bound

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - rect.y) * static_cast<std::size_t>(rect.width) +
           static_cast<std::size_t>(x - rect.x);
  }
};

/// Merges the part `rect` of exposures of images `width` pixels wide. The estimate L solves
/// sum_k t_k (d_k - t_k L) / v_k(L) = 0 over the unsaturated samples d_k (above black) with exposures t_k
/// (gain included); v_k is the sensor's variance at the merged estimate, not at the sample, whose noise would
/// else weigh itself. That is weighting by t^2 / variance; its variance 1 / sum t_k^2 / v_k is the Cramer-Rao
/// bound of independent Gaussian samples. Needs one exposure or more.
[[nodiscard]] RadianceImage merge_exposures(std::span<const Exposure> exposures, int width,
                                            const geometry::SensorModel& sensor, const PixelRect& rect);

}  // namespace rig::calibration
