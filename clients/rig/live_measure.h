// What a person wants to know of a frame while mounting and focusing: how sharp it is, how much of it is
// clipped, and which exposure would suit it. Pure functions.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/sensor.h"
#include "core/geometry/vec.h"
#include "protocol/rig.pb.h"

namespace rig::client {

/// Pixels x0 <= x < x1, y0 <= y < y1.
struct Region {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  [[nodiscard]] int width() const { return x1 - x0; }
  [[nodiscard]] int height() const { return y1 - y0; }
};

/// The smallest region around a polygon, cut to the image; the whole image where nothing is left.
[[nodiscard]] Region region_around(const std::vector<geometry::Vec2>& polygon, int width, int height);

/// Light in one colour: 0 is black, 1 is saturation.
struct Plane {
  int width = 0, height = 0;
  std::vector<float> pixels;
};

/// The green of a mosaic's region: the mean of the two green samples of each cell, so half as wide and high,
/// without interpolation. Of a sensor without a mosaic, every sample. `mosaic` is `width` samples a row.
[[nodiscard]] Plane green_of_mosaic(std::span<const std::uint16_t> mosaic, int width,
                                    geometry::BayerPattern pattern, const geometry::SensorModel& sensor,
                                    const Region& region);
/// The green of a preview's region, taken out of sRGB.
[[nodiscard]] Plane green_of_preview(const protocol::Frame& frame, const Region& region);

/// How sharp the plane is: the mean squared gradient (Sobel's operator; Tenenbaum 1970), relative to the
/// square of the mean value, so that exposure does not matter, in thousandths. Only a comparison with other
/// frames of the same scene means something. 0 where the plane is dark or too small.
[[nodiscard]] double focus_measure(const Plane& plane);

struct Exposed {
  double saturated_share = 0;  ///< of the samples, those at or above saturation
  double black_share = 0;      ///< those at or below the black level
  double level = 0;            ///< of which 99.9 % of the samples are not above: 0 black, 1 saturation
};
[[nodiscard]] Exposed exposed_of_mosaic(std::span<const std::uint16_t> mosaic, int width,
                                        const geometry::SensorModel& sensor, const Region& region);
/// Of all colours, as the preview's 8 bits tell.
[[nodiscard]] Exposed exposed_of_preview(const protocol::Frame& frame, const Region& region);

/// Where the level of a well exposed frame lies, and how far off it may be.
inline constexpr double kGoodLevel = 0.7;
inline constexpr double kLevelTolerance = 0.05;

/// The exposure time that brings the level to kGoodLevel; the one given where it is good enough. Of a frame
/// that saturates or shows nothing, a step in the right direction.
[[nodiscard]] double better_exposure(double exposure, double level);

}  // namespace rig::client
