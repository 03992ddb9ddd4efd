// Texels of a map over a rectangular sample.
#pragma once

#include "core/geometry/vec.h"

namespace rig::geometry {

/// An S x T map over a sample of width_m x height_m whose centre is the origin of the sample frame. Texel (s,
/// t), zero-based, has its centre at ((s+0.5)/S - 0.5) width, ((t+0.5)/T - 0.5) height (Mortensen and
/// Andersen 2007, 9.2, with its origin moved to the centre). Row 0 is the edge of least y.
struct SampleGrid {
  int columns = 0;  ///< S
  int rows = 0;     ///< T
  double width_m = 0;
  double height_m = 0;

  [[nodiscard]] Vec3 centre(int s, int t) const {
    return {((s + 0.5) / columns - 0.5) * width_m, ((t + 0.5) / rows - 0.5) * height_m, 0};
  }
  /// Fractional texel coordinates of a point of the sample plane; the inverse of `centre`.
  [[nodiscard]] Vec2 texel(Vec3 point_m) const {
    return {(point_m.x / width_m + 0.5) * columns - 0.5, (point_m.y / height_m + 0.5) * rows - 0.5};
  }
};

}  // namespace rig::geometry
