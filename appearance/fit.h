// Fitting reflectance models to the observations of one texel.
#pragma once

#include <array>
#include <vector>

#include "appearance/lafortune.h"
#include "core/geometry/vec.h"

namespace rig::appearance {

/// One usable observation of a texel.
struct Sample {
  geometry::Vec3 incident, exitant;  ///< unit vectors in the sample frame
  std::array<double, 3> value{};     ///< BRDF, sr^-1
  std::array<double, 3> variance{};
  bool at_least = false;  ///< saturated: the value is a lower bound
};

struct Fit {
  Lafortune model;
  double residual = 0;  ///< root mean square, luminance of f cos(theta_i)
  int count = 0;        ///< observations used
};

/// rho_d per channel by weighted least squares on f cos(theta_i); rho_s is 0.
[[nodiscard]] Fit fit_diffuse(const std::vector<Sample>& samples);

/// Diffuse and one lobe: the shape by Levenberg-Marquardt with analytic derivatives on the luminance of f
/// cos(theta_i), from McAllister's starts (2002, 4.3.1), then the colours by linear least squares, not
/// negative. What the samples leave open (few of them, none near the peak) a weak prior decides
/// (docs/mathematics/fitting.md). Saturated samples count only against models below them. With fewer than
/// eight samples the diffuse fit. Never NaN for finite samples.
[[nodiscard]] Fit fit_lafortune(const std::vector<Sample>& samples);

}  // namespace rig::appearance
