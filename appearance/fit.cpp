#include "appearance/fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "appearance/lobe_shape.h"

namespace rig::appearance {

namespace {

constexpr std::array<double, 3> kLuminance{0.2126, 0.7152, 0.0722};
constexpr std::size_t kFewest = 8;
constexpr std::size_t kEnough = 24;
constexpr double kBelievable = 4;     // cost of the prior, squared standard deviations
constexpr double kColourSigma = 1.5;  // relative to the luminance
// What no model of this kind explains, as a share of the mean value. It is the same for all samples: what
// counts in a picture is the difference, not its ratio.
constexpr double kModelError = 0.05;
constexpr int kDiffuseRounds = 8;

std::vector<LobeTerm> make_terms(const std::vector<Sample>& samples) {
  std::vector<LobeTerm> terms;
  terms.reserve(samples.size());
  double mean = 0;
  for (const Sample& s : samples) {
    double value = 0;
    double variance = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      value += kLuminance[c] * s.value[c];
      variance += kLuminance[c] * kLuminance[c] * s.variance[c];
    }
    const double cosine = s.incident.z;
    terms.push_back({s.incident.x * s.exitant.x, s.incident.y * s.exitant.y, s.incident.z * s.exitant.z,
                     cosine, value * cosine, variance * cosine * cosine, s.at_least});
    mean += std::abs(value * cosine);
  }
  mean /= static_cast<double>(std::max<std::size_t>(samples.size(), 1));
  for (LobeTerm& t : terms) {
    const double model = kModelError * mean;
    const double total = t.weight + model * model;
    t.weight = total > 0 ? 1 / total : 1;
  }
  return terms;
}

// The two factors of a model of one lobe, of a colour or of the luminance.
struct Brightness {
  double rho_d = 0, rho_s = 0;
};

// Weighted least squares of two columns (diffuse, lobe) on one channel, neither negative. The lobe's colour
// is believed to be about that of white, the luminance's, where the samples say nothing of it.
Brightness fit_channel(const std::vector<Sample>& samples, const std::vector<LobeTerm>& terms,
                       const std::vector<double>& lobes, std::size_t c, const Brightness& white) {
  double dd = 0, ds = 0, ss = 0, dy = 0, sy = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double d = terms[i].cosine;
    const double s = d * lobes[i];
    const double y = d * samples[i].value[c];
    // A lower bound counts where the luminance's model stays below it.
    if (samples[i].at_least && white.rho_d * d + white.rho_s * s > y) continue;
    const double w = terms[i].weight;
    dd += w * d * d;
    ds += w * d * s;
    ss += w * s * s;
    dy += w * d * y;
    sy += w * s * y;
  }
  if (white.rho_s > 0) {
    const double w = 1 / (kColourSigma * kColourSigma * white.rho_s * white.rho_s);
    ss += w;
    sy += w * white.rho_s;
  }
  const double determinant = dd * ss - ds * ds;
  if (determinant > 1e-12 * dd * ss) {
    const Brightness both{(ss * dy - ds * sy) / determinant, (dd * sy - ds * dy) / determinant};
    if (both.rho_d >= 0 && both.rho_s >= 0) return both;
  }
  const double only_d = dd > 0 ? std::max(0.0, dy / dd) : 0;
  const double only_s = ss > 0 ? std::max(0.0, sy / ss) : 0;
  // The better of the two edges: what each takes off the squared error.
  return only_s * sy > only_d * dy ? Brightness{0, only_s} : Brightness{only_d, 0};
}

double luminance(const std::array<double, 3>& rgb) {
  return kLuminance[0] * rgb[0] + kLuminance[1] * rgb[1] + kLuminance[2] * rgb[2];
}

// The terms with the weights that Huber's loss gives them at this model of the luminance.
std::vector<LobeTerm> weighted_for(std::vector<LobeTerm> terms, const Brightness& white,
                                   const std::vector<double>& lobes) {
  for (std::size_t i = 0; i < terms.size(); ++i) {
    LobeTerm& t = terms[i];
    t.weight *= huber_share(t.cosine * (white.rho_d + white.rho_s * lobes[i]) - t.value, t.weight);
  }
  return terms;
}

double root_mean_square(const std::vector<Sample>& samples, const Lafortune& model) {
  double sum = 0;
  for (const Sample& s : samples) {
    double r = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      r += kLuminance[c] * s.incident.z * (evaluate(model, s.incident, s.exitant, c) - s.value[c]);
    }
    if (s.at_least && r > 0) continue;
    sum += r * r;
  }
  return samples.empty() ? 0 : std::sqrt(sum / static_cast<double>(samples.size()));
}

// The 10th percentile of the luminance BRDF: where the lobe is not (McAllister 2002, 4.3).
double low_percentile(const std::vector<LobeTerm>& terms) {
  std::vector<double> values;
  values.reserve(terms.size());
  for (const LobeTerm& t : terms) values.push_back(t.cosine > 0 ? t.value / t.cosine : 0);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 10);
  std::nth_element(values.begin(), at, values.end());
  return std::max(0.0, *at);
}

// The best shape from McAllister's starts (2002, 4.3.1) and a sharper one; infinite cost where none is
// finite.
double best_shape(const std::vector<LobeTerm>& terms, LobeParameters& best) {
  const double low = low_percentile(terms);
  double high = 0;
  for (const LobeTerm& t : terms) high = std::max(high, t.cosine > 0.05 ? t.value / t.cosine : 0.0);
  const double amplitude = std::max(high - low, 1e-6);
  struct Start {
    double x, y, z, n;
  };
  // A forward lobe, a sharper one, and one towards the light.
  constexpr std::array<Start, 3> kStarts{{{-1, -1, 1, 10}, {-1, -1, 1, 40}, {1, 1, 1, 5}}};
  double best_cost = std::numeric_limits<double>::infinity();
  for (const Start& start : kStarts) {
    const double scale = std::pow(amplitude, 1 / start.n);
    LobeParameters p{low, scale * start.x, scale * start.y, scale * start.z, std::log(start.n)};
    const double cost = minimise_lobe(terms, {amplitude, 1}, p);
    if (cost < best_cost) {
      best_cost = cost;
      best = p;
    }
  }
  if (terms.size() < kEnough || !std::isfinite(best_cost)) return best_cost;
  // Enough samples speak for themselves, unless what they say alone is hardly to be believed.
  LobeParameters alone = best;
  const double cost = minimise_lobe(terms, {amplitude, 0}, alone);
  if (prior_cost({amplitude, 1}, alone) <= kBelievable) {
    best_cost = cost;
    best = alone;
  }
  return best_cost;
}

}  // namespace

Fit fit_diffuse(const std::vector<Sample>& samples) {
  Fit fit;
  fit.count = static_cast<int>(samples.size());
  const std::vector<LobeTerm> terms = make_terms(samples);
  const std::vector<double> no_lobe(samples.size(), 0.0);
  std::vector<LobeTerm> reweighted = terms;
  for (int round = 0; round < kDiffuseRounds; ++round) {
    for (std::size_t c = 0; c < 3; ++c)
      fit.model.rho_d[c] = fit_channel(samples, reweighted, no_lobe, c, {}).rho_d;
    reweighted = weighted_for(terms, {luminance(fit.model.rho_d), 0}, no_lobe);
  }
  fit.residual = root_mean_square(samples, fit.model);
  return fit;
}

Fit fit_lafortune(const std::vector<Sample>& samples) {
  if (samples.size() < kFewest) return fit_diffuse(samples);
  const std::vector<LobeTerm> terms = make_terms(samples);
  LobeParameters best{};
  if (!std::isfinite(best_shape(terms, best))) return fit_diffuse(samples);
  Fit fit;
  fit.count = static_cast<int>(samples.size());
  // The common factor of the coefficients is brightness: it goes to rho_s, and the largest of them becomes 1.
  const double size = std::max({std::abs(best[1]), std::abs(best[2]), std::abs(best[3])});
  fit.model.cx = best[1] / size;
  fit.model.cy = best[2] / size;
  fit.model.cz = best[3] / size;
  fit.model.n = std::exp(best[4]);
  const Brightness white{best[0], std::pow(size, fit.model.n)};
  std::vector<double> lobes;
  lobes.reserve(samples.size());
  for (const Sample& s : samples) lobes.push_back(lobe(fit.model, s.incident, s.exitant));
  const auto reweighted = weighted_for(terms, white, lobes);
  for (std::size_t c = 0; c < 3; ++c) {
    const Brightness colour = fit_channel(samples, reweighted, lobes, c, white);
    fit.model.rho_d[c] = colour.rho_d;
    fit.model.rho_s[c] = colour.rho_s;
  }
  fit.residual = root_mean_square(samples, fit.model);
  return std::isfinite(fit.residual) ? fit : fit_diffuse(samples);
}

}  // namespace rig::appearance
