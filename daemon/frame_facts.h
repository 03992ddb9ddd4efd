// What rigd says about a frame as soon as it is there: how much of the sample is saturated, and a small
// picture.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/vec.h"
#include "core/machine/rig_config.h"
#include "daemon/sample_histogram.h"

namespace rig::daemon {

/// Share of the pixels inside the polygon (image coordinates) that reach the saturation level; of the whole
/// image where the polygon is empty.
[[nodiscard]] double saturated_share(const machine::CameraConfig& camera,
                                     std::span<const std::uint16_t> pixels,
                                     const std::vector<geometry::Vec2>& polygon);

/// Mean of the pixels inside the polygon (all where it is empty) above the black level, in DN: of the green
/// ones of a mosaic, of all of a grey sensor. Nothing where none is inside.
[[nodiscard]] std::optional<double> mean_above_black_dn(const machine::CameraConfig& camera,
                                                        std::span<const std::uint16_t> pixels,
                                                        const std::vector<geometry::Vec2>& polygon);

/// The raw values of the pixels inside the polygon, colour by colour; of the whole image where it is empty.
[[nodiscard]] SampleHistogram sample_histogram(const machine::CameraConfig& camera,
                                               std::span<const std::uint16_t> pixels,
                                               const std::vector<geometry::Vec2>& polygon);

struct Preview {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< sRGB
};
/// A picture of at most `widest` pixels a row, from whole cells of the mosaic, white balanced.
[[nodiscard]] Preview make_preview(const machine::CameraConfig& camera, std::span<const std::uint16_t> pixels,
                                   int widest);

}  // namespace rig::daemon
