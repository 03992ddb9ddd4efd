// Diffuse reflection with one generalised cosine lobe (Lafortune et al. 1997; McAllister 2002, 4.2).
#pragma once

#include <array>

#include "core/geometry/vec.h"

namespace rig::appearance {

/// f = rho_d + rho_s (Cx wi.x wr.x + Cy wi.y wr.y + Cz wi.z wr.z)^n per channel, 0 for the lobe where the sum
/// is not positive. rho_d and rho_s are BRDF values, sr^-1; the shape is shared by the channels. Reciprocal.
struct Lafortune {
  std::array<double, 3> rho_d{};
  std::array<double, 3> rho_s{};
  double cx = -1, cy = -1, cz = 1;
  double n = 10;
};

/// Value of the lobe alone, without rho_s.
[[nodiscard]] double lobe(const Lafortune& model, geometry::Vec3 wi, geometry::Vec3 wr);

/// BRDF of one channel, sr^-1.
[[nodiscard]] double evaluate(const Lafortune& model, geometry::Vec3 wi, geometry::Vec3 wr,
                              std::size_t channel);

}  // namespace rig::appearance
