#include "appearance/lobe_shape.h"

#include <algorithm>
#include <cmath>

namespace rig::appearance {

namespace {

constexpr std::size_t kParameters = std::tuple_size_v<LobeParameters>;
constexpr double kLowestN = 0.5;
constexpr double kHighestN = 400;
constexpr double kLowestAz = 1e-3;
constexpr int kMostSteps = 40;

using Matrix = std::array<double, kParameters * kParameters>;

// Huber's loss of a residual: as written in the header, continuous with its slope.
double huber_cost(double residual, double weight) {
  const double u = std::sqrt(weight) * std::abs(residual);
  return u <= kHuber ? u * u : kHuber * (2 * u - kHuber);
}

// Cost with its gradient and Gauss-Newton matrix, residual by residual.
struct Normal {
  double cost = 0;
  bool derivatives = false;
  Matrix matrix{};
  LobeParameters gradient{};

  void add(double residual, double weight, const LobeParameters& j) {
    add(residual, weight, j, weight * residual * residual);
  }
  void add(double residual, double weight, const LobeParameters& j, double loss) {
    cost += loss;
    if (!derivatives) return;
    for (std::size_t a = 0; a < kParameters; ++a) {
      gradient[a] += weight * j[a] * residual;
      for (std::size_t b = a; b < kParameters; ++b) matrix[a * kParameters + b] += weight * j[a] * j[b];
    }
  }
};

void add_samples(const std::vector<LobeTerm>& terms, const LobeParameters& p, Normal& normal) {
  const double n = std::exp(p[4]);
  for (const LobeTerm& t : terms) {
    const double s = p[1] * t.px + p[2] * t.py + p[3] * t.pz;
    const double log_s = s > 0 ? std::log(s) : 0;
    const double value = s > 0 ? std::exp(n * log_s) : 0;
    const double r = t.cosine * (p[0] + value) - t.value;
    if (t.at_least && r > 0) continue;
    const double slope = s > 0 ? t.cosine * n * value / s : 0;
    normal.add(r, t.weight * huber_share(r, t.weight),
               {t.cosine, slope * t.px, slope * t.py, slope * t.pz, t.cosine * n * value * log_s},
               huber_cost(r, t.weight));
  }
}

void add_prior(const LobePrior& prior, const LobeParameters& p, Normal& normal) {
  // A lobe's exponent is believed to be within a factor of e^2 of 20, its peak over the hemisphere within e^2
  // of the largest value seen, and its coefficients to be about those of a mirror.
  constexpr double kLogN = 3.0;
  constexpr double kSigmaLogN = 2;
  constexpr double kSigmaLogPeak = 2;
  constexpr double kSigmaMirror = 1;
  const double n = std::exp(p[4]);
  normal.add((p[4] - kLogN) / kSigmaLogN, prior.weight, {0, 0, 0, 0, 1 / kSigmaLogN});
  std::size_t largest = 3;
  for (const std::size_t i : {std::size_t{1}, std::size_t{2}}) {
    if (std::abs(p[i]) > std::abs(p[largest])) largest = i;
    LobeParameters j{};
    j[i] = j[3] = 1 / kSigmaMirror;
    normal.add((p[i] + p[3]) / kSigmaMirror, prior.weight, j);
  }
  const double log_size = std::log(std::abs(p[largest]));
  LobeParameters j{};
  j[largest] = n / (p[largest] * kSigmaLogPeak);
  j[4] = n * log_size / kSigmaLogPeak;
  normal.add((n * log_size - std::log(prior.peak)) / kSigmaLogPeak, prior.weight, j);
}

Normal cost_of(const std::vector<LobeTerm>& terms, const LobePrior& prior, const LobeParameters& p,
               bool derivatives) {
  Normal normal;
  normal.derivatives = derivatives;
  add_samples(terms, p, normal);
  if (prior.weight > 0) add_prior(prior, p, normal);
  return normal;
}

// Solves the damped normal equations by Cholesky; false where they are not positive definite.
bool solve(Matrix m, const LobeParameters& gradient, double damping, LobeParameters& step) {
  for (std::size_t a = 0; a < kParameters; ++a)
    m[a * kParameters + a] += damping * m[a * kParameters + a] + 1e-14;
  Matrix l{};
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

}  // namespace

double huber_share(double residual, double weight) {
  const double u = std::sqrt(weight) * std::abs(residual);
  return u <= kHuber ? 1 : kHuber / u;
}

double prior_cost(const LobePrior& prior, const LobeParameters& p) {
  Normal normal;
  add_prior({prior.peak, 1}, p, normal);
  return normal.cost;
}

double minimise_lobe(const std::vector<LobeTerm>& terms, const LobePrior& prior, LobeParameters& p) {
  Normal here = cost_of(terms, prior, p, true);
  double damping = 1e-3;
  for (int i = 0; i < kMostSteps && damping < 1e8; ++i) {
    LobeParameters step{};
    if (!solve(here.matrix, here.gradient, damping, step)) {
      damping *= 10;
      continue;
    }
    LobeParameters trial = p;
    for (std::size_t a = 0; a < kParameters; ++a) trial[a] += step[a];
    trial[0] = std::max(trial[0], 0.0);
    trial[3] = std::max(trial[3], kLowestAz);
    trial[4] = std::clamp(trial[4], std::log(kLowestN), std::log(kHighestN));
    const double now = cost_of(terms, prior, trial, false).cost;
    if (!(now < here.cost)) {
      damping *= 8;
      continue;
    }
    const bool small = here.cost - now < 1e-6 * here.cost;
    p = trial;
    here = cost_of(terms, prior, p, true);
    damping = std::max(damping * 0.2, 1e-9);
    if (small) break;
  }
  return here.cost;
}

}  // namespace rig::appearance
