// A grey image of something achromatic, from the raw samples of a colour mosaic, at the sensor's full
// resolution.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/sensor.h"

namespace rig::calibration {

/// Linear grey values, row-major; 0 is no light.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<float> pixels;

  [[nodiscard]] float at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

/// Each sample above black times the white balance of its colour, in digital numbers. Where the scene is
/// achromatic, as fiducials are, that needs no interpolation: every pixel is a measured value. Coloured parts
/// of the scene show the mosaic. Values are clipped where the first colour saturates, so that a saturated
/// area is even. `mosaic` holds width * height samples.
[[nodiscard]] GreyImage grey_from_mosaic(std::span<const std::uint16_t> mosaic, int width, int height,
                                         geometry::BayerPattern pattern, const geometry::SensorModel& sensor,
                                         const std::array<double, 3>& white_balance);

}  // namespace rig::calibration
