#include "appearance/fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rig::appearance {

namespace {

constexpr std::array<double, 3> kLuminance{0.2126, 0.7152, 0.0722};
constexpr std::size_t kParameters = 5;  // rho_d, amplitudes ax, ay, az, log n
constexpr std::size_t kFewest = 8;
constexpr double kModelError = 0.05;  // share of a value that no model of this kind explains
constexpr double kLowestN = 0.5;
constexpr double kHighestN = 400;
constexpr int kMostSteps = 40;

using Vector = std::array<double, kParameters>;

// A sample as the shape fit sees it: luminance of radiance per irradiance, its weight, and the three
// products.
struct Term {
  double px, py, pz, cosine, value, weight;
};

std::vector<Term> make_terms(const std::vector<Sample>& samples) {
  std::vector<Term> terms;
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
                     cosine, value * cosine, variance * cosine * cosine});
    mean += std::abs(value * cosine);
  }
  mean /= static_cast<double>(std::max<std::size_t>(samples.size(), 1));
  for (Term& t : terms) {
    const double model = kModelError * (std::abs(t.value) + mean);
    const double total = t.weight + model * model;
    t.weight = total > 0 ? 1 / total : 1;
  }
  return terms;
}

// The lobe is (ax px + ay py + az pz)^n: rho_s is absorbed into the coefficients, as McAllister does for one
// lobe.
double cost_of(const std::vector<Term>& terms, const Vector& p,
               std::array<double, kParameters * kParameters>* normal, Vector* gradient) {
  const double n = std::exp(p[4]);
  double cost = 0;
  if (normal != nullptr) normal->fill(0);
  if (gradient != nullptr) gradient->fill(0);
  for (const Term& t : terms) {
    const double s = p[1] * t.px + p[2] * t.py + p[3] * t.pz;
    const double log_s = s > 0 ? std::log(s) : 0;
    const double value = s > 0 ? std::exp(n * log_s) : 0;
    const double r = t.cosine * (p[0] + value) - t.value;
    cost += t.weight * r * r;
    if (normal == nullptr || gradient == nullptr) continue;
    const double slope = s > 0 ? t.cosine * n * value / s : 0;
    const Vector j{t.cosine, slope * t.px, slope * t.py, slope * t.pz, t.cosine * n * value * log_s};
    for (std::size_t a = 0; a < kParameters; ++a) {
      (*gradient)[a] += t.weight * j[a] * r;
      for (std::size_t b = a; b < kParameters; ++b) (*normal)[a * kParameters + b] += t.weight * j[a] * j[b];
    }
  }
  return cost;
}

// Solves the damped normal equations by Cholesky; false where they are not positive definite.
bool solve(std::array<double, kParameters * kParameters> m, const Vector& gradient, double damping,
           Vector& step) {
  for (std::size_t a = 0; a < kParameters; ++a)
    m[a * kParameters + a] += damping * m[a * kParameters + a] + 1e-14;
  std::array<double, kParameters * kParameters> l{};
  for (std::size_t i = 0; i < kParameters; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = m[j * kParameters + i];
      for (std::size_t k = 0; k < j; ++k) sum -= l[i * kParameters + k] * l[j * kParameters + k];
      if (i == j) {
        if (!(sum > 0)) return false;
        l[i * kParameters + i] = std::sqrt(sum);
      } else {
        l[i * kParameters + j] = sum / l[j * kParameters + j];
      }
    }
  }
  for (std::size_t i = 0; i < kParameters; ++i) {
    double sum = -gradient[i];
    for (std::size_t k = 0; k < i; ++k) sum -= l[i * kParameters + k] * step[k];
    step[i] = sum / l[i * kParameters + i];
  }
  for (std::size_t i = kParameters; i-- > 0;) {
    double sum = step[i];
    for (std::size_t k = i + 1; k < kParameters; ++k) sum -= l[k * kParameters + i] * step[k];
    step[i] = sum / l[i * kParameters + i];
  }
  return std::all_of(step.begin(), step.end(), [](double x) { return std::isfinite(x); });
}

double minimise(const std::vector<Term>& terms, Vector& p) {
  std::array<double, kParameters * kParameters> normal{};
  Vector gradient{};
  double cost = cost_of(terms, p, &normal, &gradient);
  double damping = 1e-3;
  for (int i = 0; i < kMostSteps && damping < 1e8; ++i) {
    Vector step{};
    if (!solve(normal, gradient, damping, step)) {
      damping *= 10;
      continue;
    }
    Vector trial = p;
    for (std::size_t a = 0; a < kParameters; ++a) trial[a] += step[a];
    trial[0] = std::max(trial[0], 0.0);
    trial[4] = std::clamp(trial[4], std::log(kLowestN), std::log(kHighestN));
    const double now = cost_of(terms, trial, nullptr, nullptr);
    if (!(now < cost)) {
      damping *= 8;
      continue;
    }
    const bool small = cost - now < 1e-6 * cost;
    p = trial;
    cost = cost_of(terms, p, &normal, &gradient);
    damping = std::max(damping * 0.2, 1e-9);
    if (small) break;
  }
  return cost;
}

// Weighted least squares of two columns (diffuse, lobe) on one channel, neither negative.
void fit_channel(const std::vector<Sample>& samples, const std::vector<Term>& terms,
                 const std::vector<double>& lobes, std::size_t c, double& rho_d, double& rho_s) {
  double dd = 0, ds = 0, ss = 0, dy = 0, sy = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double cosine = terms[i].cosine;
    const double d = cosine;
    const double s = cosine * lobes[i];
    const double y = cosine * samples[i].value[c];
    const double w = terms[i].weight;
    dd += w * d * d;
    ds += w * d * s;
    ss += w * s * s;
    dy += w * d * y;
    sy += w * s * y;
  }
  const double determinant = dd * ss - ds * ds;
  if (determinant > 1e-12 * dd * ss) {
    rho_d = (ss * dy - ds * sy) / determinant;
    rho_s = (dd * sy - ds * dy) / determinant;
    if (rho_d >= 0 && rho_s >= 0) return;
  }
  const double only_d = dd > 0 ? std::max(0.0, dy / dd) : 0;
  const double only_s = ss > 0 ? std::max(0.0, sy / ss) : 0;
  // The better of the two edges: what each takes off the squared error.
  if (only_s * sy > only_d * dy) {
    rho_d = 0;
    rho_s = only_s;
  } else {
    rho_d = only_d;
    rho_s = 0;
  }
}

double root_mean_square(const std::vector<Sample>& samples, const Lafortune& model) {
  double sum = 0;
  for (const Sample& s : samples) {
    double r = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      r += kLuminance[c] * s.incident.z * (evaluate(model, s.incident, s.exitant, c) - s.value[c]);
    }
    sum += r * r;
  }
  return samples.empty() ? 0 : std::sqrt(sum / static_cast<double>(samples.size()));
}

// The 10th percentile of the luminance BRDF: where the lobe is not (McAllister 2002, 4.3).
double low_percentile(const std::vector<Term>& terms) {
  std::vector<double> values;
  values.reserve(terms.size());
  for (const Term& t : terms) values.push_back(t.cosine > 0 ? t.value / t.cosine : 0);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 10);
  std::nth_element(values.begin(), at, values.end());
  return std::max(0.0, *at);
}

}  // namespace

Fit fit_diffuse(const std::vector<Sample>& samples) {
  Fit fit;
  fit.count = static_cast<int>(samples.size());
  const std::vector<Term> terms = make_terms(samples);
  const std::vector<double> no_lobe(samples.size(), 0.0);
  for (std::size_t c = 0; c < 3; ++c)
    fit_channel(samples, terms, no_lobe, c, fit.model.rho_d[c], fit.model.rho_s[c]);
  fit.residual = root_mean_square(samples, fit.model);
  return fit;
}

Fit fit_lafortune(const std::vector<Sample>& samples) {
  if (samples.size() < kFewest) return fit_diffuse(samples);
  const std::vector<Term> terms = make_terms(samples);
  const double low = low_percentile(terms);
  double high = 0;
  for (const Term& t : terms) high = std::max(high, t.cosine > 0.05 ? t.value / t.cosine : 0.0);
  const double amplitude = std::max(high - low, 1e-6);
  // A forward lobe, a sharper one, and one towards the light.
  struct Start {
    double x, y, z, n;
  };
  constexpr std::array<Start, 3> kStarts{{{-1, -1, 1, 10}, {-1, -1, 1, 40}, {1, 1, 1, 5}}};
  Vector best{};
  double best_cost = std::numeric_limits<double>::infinity();
  for (const Start& start : kStarts) {
    const double scale = std::pow(amplitude, 1 / start.n);
    Vector p{low, scale * start.x, scale * start.y, scale * start.z, std::log(start.n)};
    const double cost = minimise(terms, p);
    if (cost < best_cost) {
      best_cost = cost;
      best = p;
    }
  }
  if (!std::isfinite(best_cost)) return fit_diffuse(samples);
  Fit fit;
  fit.count = static_cast<int>(samples.size());
  // The common factor of the coefficients is brightness: it goes to rho_s, and the largest of them becomes 1.
  const double size = std::max({std::abs(best[1]), std::abs(best[2]), std::abs(best[3]), 1e-12});
  fit.model.cx = best[1] / size;
  fit.model.cy = best[2] / size;
  fit.model.cz = best[3] / size;
  fit.model.n = std::exp(best[4]);
  std::vector<double> lobes;
  lobes.reserve(samples.size());
  for (const Sample& s : samples) lobes.push_back(lobe(fit.model, s.incident, s.exitant));
  for (std::size_t c = 0; c < 3; ++c)
    fit_channel(samples, terms, lobes, c, fit.model.rho_d[c], fit.model.rho_s[c]);
  fit.residual = root_mean_square(samples, fit.model);
  return fit;
}

}  // namespace rig::appearance
