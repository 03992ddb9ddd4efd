// The fit of one texel beside Ceres on the same residuals from the same starts, one core each, in turn.
#include <benchmark/benchmark.h>
#include <ceres/ceres.h>
#include <chrono>
#include <cmath>

#include "appearance/fit.h"
#include "core/base/random.h"
#include "core/geometry/directions.h"

namespace {

using namespace rig;
using Steady = std::chrono::steady_clock;

std::vector<appearance::Sample> make_samples(std::size_t count) {
  base::Random random(1);
  const appearance::Lafortune truth{{0.1, 0.08, 0.05}, {0.5, 0.5, 0.5}, -1, -0.9, 0.95, 18};
  std::vector<appearance::Sample> samples;
  for (std::size_t i = 0; i < count; ++i) {
    const auto direction = [&random] {
      return geometry::direction_from_polar({random.uniform(0, 1.2), random.uniform(-3.1, 3.1)});
    };
    appearance::Sample s{direction(), direction(), {}, {}, false};
    for (std::size_t c = 0; c < 3; ++c) {
      s.value[c] = appearance::evaluate(truth, s.incident, s.exitant, c) * (1 + 0.02 * random.normal());
      s.variance[c] = 1e-6;
    }
    samples.push_back(s);
  }
  return samples;
}

// f cos(theta_i) of the luminance, as appearance/lobe_shape.h has it; Ceres finds the derivatives.
struct Residual {
  const appearance::Sample* sample;
  double value;
  template <typename T>
  bool operator()(const T* p, T* residual) const {
    const auto& a = sample->incident;
    const auto& b = sample->exitant;
    const T s = p[1] * (a.x * b.x) + p[2] * (a.y * b.y) + p[3] * (a.z * b.z);
    const T lobe = s > T(0) ? ceres::exp(ceres::exp(p[4]) * ceres::log(s)) : T(0);
    residual[0] = a.z * (p[0] + lobe) - value;
    return true;
  }
};

double fit_with_ceres(const std::vector<appearance::Sample>& samples) {
  double best = INFINITY;
  for (const auto& [x, y, z, n] :
       {std::array{-1.0, -1.0, 1.0, 10.0}, {-1.0, -1.0, 1.0, 40.0}, {1.0, 1.0, 1.0, 5.0}}) {
    std::array<double, 5> p{0.08, x, y, z, std::log(n)};
    ceres::Problem problem;
    for (const auto& s : samples) {
      const double value = s.incident.z * (0.2126 * s.value[0] + 0.7152 * s.value[1] + 0.0722 * s.value[2]);
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Residual, 1, 5>(new Residual{&s, value}),
                               new ceres::HuberLoss(0.01), p.data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.num_threads = 1;
    options.max_num_iterations = 40;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    best = std::min(best, summary.final_cost);
  }
  return best;
}

void fit_beside_ceres(benchmark::State& state) {
  const auto samples = make_samples(static_cast<std::size_t>(state.range(0)));
  double ours_s = 0;
  double ceres_s = 0;
  for ([[maybe_unused]] auto _ : state) {
    const auto begin = Steady::now();
    benchmark::DoNotOptimize(appearance::fit_lafortune(samples));
    const auto middle = Steady::now();
    benchmark::DoNotOptimize(fit_with_ceres(samples));
    const auto end = Steady::now();
    const double ours = std::chrono::duration<double>(middle - begin).count();
    state.SetIterationTime(ours);
    ours_s += ours;
    ceres_s += std::chrono::duration<double>(end - middle).count();
  }
  state.counters["ceres_time_over_ours"] = ceres_s / ours_s;
}
BENCHMARK(fit_beside_ceres)->Arg(66)->Arg(350)->UseManualTime()->Unit(benchmark::kMicrosecond);

}  // namespace
