#include "calibration/fiducials/grey_image.h"

#include <algorithm>

namespace rig::calibration {

GreyImage grey_from_mosaic(std::span<const std::uint16_t> mosaic, int width, int height,
                           geometry::BayerPattern pattern, const geometry::SensorModel& sensor,
                           const std::array<double, 3>& white_balance) {
  GreyImage grey{width, height, std::vector<float>(mosaic.size())};
  const auto black = static_cast<float>(sensor.black_dn);
  const auto clip = static_cast<float>((sensor.saturation_dn - sensor.black_dn) *
                                       *std::min_element(white_balance.begin(), white_balance.end()));
  for (int y = 0; y < height; ++y) {
    // The pattern repeats every two pixels.
    std::array<float, 2> factor{};
    for (int x = 0; x < 2; ++x) {
      factor[static_cast<std::size_t>(x)] =
          static_cast<float>(white_balance[static_cast<std::size_t>(geometry::colour_at(pattern, x, y))]);
    }
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
      grey.pixels[row + x] = std::min(clip, (static_cast<float>(mosaic[row + x]) - black) * factor[x % 2]);
    }
  }
  return grey;
}

}  // namespace rig::calibration
