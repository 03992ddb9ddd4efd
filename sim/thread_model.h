// Light on threads: each is a cylinder too thin to see (after Sadeghi, Bisker, De Deken and Jensen 2013).
#pragma once

#include <array>

#include "sim/vector.h"

namespace rig::sim {

/// A kind of thread. Widths are standard deviations of the longitudinal angle.
struct Thread {
  std::array<double, 3> colour{};  ///< of light scattered inside, 0 .. 1
  double surface = 0.05;           ///< share reflected at the surface
  double surface_width_rad = 0.2;
  double volume_width_rad = 0.5;
  double isotropic = 0.3;  ///< share of the inner scattering that has lost its direction
  double slope_rad = 0.3;  ///< how steeply a thread rises and falls over a crossing
};

/// BRDF, in sr^-1, of a surface of parallel threads along the unit vector `tangent` (in the plane z = 0),
/// averaged over the rise and fall of the thread. Reciprocal.
[[nodiscard]] double thread_brdf(const Thread& thread, V3 tangent, V3 wi, V3 wr, int channel);

}  // namespace rig::sim
