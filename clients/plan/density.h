// How far apart poses may be for a material of a given sharpness (McAllister 2002, 3.3.2).
#pragma once

#include "core/base/result.h"

namespace rig::plan {

/// What a highlight of the form cos^sharpness asks for.
struct Density {
  double highlight_rad = 0;  ///< theta_r: angle from the peak where the highlight has fallen to the threshold
  double hemisphere_share = 0;  ///< g: the part of the hemisphere it covers
  double poses = 0;             ///< m: uniformly spread samples so that per_highlight fall into it on average
  double apart_2d_rad = 0;      ///< theta_d,2: spacing where one direction is fixed
  double apart_3d_rad = 0;      ///< theta_d,3: spacing of isotropic direction pairs
  double apart_4d_rad = 0;      ///< theta_d,4: spacing of anisotropic direction pairs
};

/// `threshold` is relative to the peak, in (0, 1); `per_highlight` is the number of samples wanted within a
/// highlight, at least the parameters of a lobe (4 for one of Lafortune). Refuses values outside the domain.
[[nodiscard]] base::Result<Density> density_for(double sharpness, double threshold, double per_highlight);

}  // namespace rig::plan
