// The shape of one lobe on the luminance of one texel: Levenberg-Marquardt. Private to appearance.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace rig::appearance {

/// A sample as the shape fit sees it: luminance of f cos(theta_i), its weight (inverse variance, the model's
/// own error included), and the three products of the directions' components.
struct LobeTerm {
  double px, py, pz, cosine, value, weight;
  bool at_least;  ///< the value is a lower bound: it counts only against models below it
};

/// rho_d, the amplitudes ax, ay, az and log n of (ax px + ay py + az pz)^n: rho_s is absorbed into the
/// amplitudes, as McAllister (2002, 4.3) does for one lobe.
using LobeParameters = std::array<double, 5>;

/// What is believed of a lobe before it was seen; one unit of cost is one standard deviation. It decides only
/// where the samples do not: few of them, or none near the lobe's peak. `peak` is the largest luminance BRDF
/// observed.
struct LobePrior {
  double peak = 0;
  double weight = 1;  ///< 0: the samples alone
};
/// Cost of the prior alone, at weight 1.
[[nodiscard]] double prior_cost(const LobePrior& prior, const LobeParameters& p);

/// Residuals count squared up to this many standard deviations, beyond it linearly (Huber 1964): a model of
/// one lobe errs most where the material is least like it, and those samples must not bend it everywhere
/// else.
inline constexpr double kHuber = 1;
/// The share, 0 .. 1, with which a residual's square counts.
[[nodiscard]] double huber_share(double residual, double weight);

/// Minimises the weighted residuals and the prior from `p` on, with analytic derivatives; the cost.
[[nodiscard]] double minimise_lobe(const std::vector<LobeTerm>& terms, const LobePrior& prior,
                                   LobeParameters& p);

}  // namespace rig::appearance
