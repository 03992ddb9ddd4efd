// Sub-pixel corners of a tag's black square from its four edges.
#pragma once

#include <array>
#include <optional>

#include "calibration/fiducials/grey_image.h"
#include "core/geometry/camera.h"
#include "core/geometry/vec.h"

namespace rig::calibration {

struct RefinedCorners {
  std::array<geometry::Vec2, 4> corners;
  std::array<double, 4> sigma_px{};  ///< standard deviation, root mean square of both directions
};

/// Fits the model of edge_model.h (offset, slope, dark, bright, blur) to the pixels in a strip along each
/// edge of a quadrilateral known to about a pixel, and intersects neighbouring lines. `cells` is the number
/// of code cells across the square, border included; the strip stays inside the border and the white margin,
/// each one cell wide. With `lens` the edges are the slightly bent images of straight lines. Nothing where a
/// strip leaves the image, is too narrow to hold an edge, or the fit does not converge near its start.
[[nodiscard]] std::optional<RefinedCorners> refine_corners(const GreyImage& image,
                                                           const std::array<geometry::Vec2, 4>& corners,
                                                           int cells, const geometry::CameraIntrinsics* lens);

}  // namespace rig::calibration
