// Measured-like isotropic materials: the shifted gamma distribution model of Bagher, Soler and Holzschuch
// (2012).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/vector.h"

namespace rig::sim {

/// One colour channel's parameters, in the symbols of the paper.
struct SgdChannel {
  double rho_d, rho_s, alpha, p, f0, f1, kap, lambda, c, k, theta0;
};

struct SgdMaterial {
  std::string name;
  std::array<SgdChannel, 3> rgb;
};

[[nodiscard]] const std::vector<SgdMaterial>& sgd_materials();

/// f = (shade rho_d + rho_s F D G1 G1 / (cos_i cos_r)) / pi, in sr^-1; 0 below the horizon. Reciprocal.
[[nodiscard]] double sgd_brdf(const SgdChannel& material, V3 wi, V3 wr, double shade = 1);

}  // namespace rig::sim
