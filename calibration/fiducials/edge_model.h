// What square pixels see of a straight edge between dark and bright through a blurring lens, in closed form.
#pragma once

#include "core/geometry/vec.h"

namespace rig::calibration {

/// The share of light (0 dark .. 1 bright) in a unit square pixel, and its derivatives.
struct EdgeShare {
  double share = 0;
  double by_distance = 0;
  double by_blur = 0;
};

/// For a pixel whose centre is `distance_px` from the edge, positive on the bright side, an edge whose unit
/// normal is `normal`, and a Gaussian blur of standard deviation `blur_px` > 0. The pixel's square, seen
/// along the normal, is the convolution of two boxes of widths |normal.x| and |normal.y|; the edge blurred by
/// the Gaussian and by both boxes is a second difference of E[max(0, d + blur z)^2] / 2, z standard normal.
[[nodiscard]] EdgeShare edge_share(double distance_px, geometry::Vec2 normal, double blur_px);

}  // namespace rig::calibration
