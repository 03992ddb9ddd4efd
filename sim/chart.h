// The sample of the virtual rig: a chart of 160 mm with text, patches of measured-like materials and two
// textiles.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/thread_model.h"
#include "sim/vector.h"

namespace rig::sim {

/// What stands at one point of the chart.
struct Spot {
  int region = 0;       ///< index into region_names()
  int material = -1;    ///< index into sgd_materials(); -1: thread
  int thread = -1;      ///< index into threads(); -1: SGD
  V3 tangent{1, 0, 0};  ///< of the thread
  double shade = 1;     ///< factor on rho_d of SGD, on all of a thread
};

[[nodiscard]] const std::vector<std::string>& region_names();

/// The chart's kinds of thread: warp, weft, satin.
[[nodiscard]] const std::array<Thread, 3>& threads();

/// The spot at (x, y) mm from the centre.
[[nodiscard]] Spot spot_at(double x_mm, double y_mm);

/// BRDF in sr^-1 of one channel (0 R, 1 G, 2 B).
[[nodiscard]] double spot_brdf(const Spot& spot, V3 wi, V3 wr, int channel);

/// Mean SGD alpha of the spot's material; 1 for threads.
[[nodiscard]] double spot_alpha(const Spot& spot);
/// Diffuse albedo: rho_d of SGD, the colour of a thread's inner scattering; shaded.
[[nodiscard]] std::array<double, 3> spot_albedo(const Spot& spot);

}  // namespace rig::sim
