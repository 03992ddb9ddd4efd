#include "clients/plan/pose_choice.h"

#include <algorithm>
#include <cmath>

#include "clients/plan/pair_grid.h"
#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/base/random.h"
#include "core/base/units.h"
#include "core/machine/kinematics.h"
#include "core/machine/limits.h"

namespace rig::plan {

using base::ErrorCode;
using base::fail;
using machine::AxisId;
using machine::JointAngles;

namespace {

constexpr auto kRoll = static_cast<std::size_t>(AxisId::roll);
constexpr auto kTilt = static_cast<std::size_t>(AxisId::tilt);
constexpr auto kPan = static_cast<std::size_t>(AxisId::pan);
constexpr auto kArm = static_cast<std::size_t>(AxisId::arm);

// Angles that are short in a file: `per_deg` steps to a degree.
double rounded(double angle_rad, double per_deg) {
  return base::radians(std::round(base::degrees(angle_rad) * per_deg) / per_deg);
}

// The multiples of the step within the limits, those nearest to zero first.
std::vector<double> stations(const machine::AxisConfig& axis, double step_rad) {
  std::vector<double> out;
  const auto first = static_cast<long>(std::ceil(axis.min_rad / step_rad - 1e-9));
  const auto last = static_cast<long>(std::floor(axis.max_rad / step_rad + 1e-9));
  for (long k = first; k <= last; ++k) {
    out.push_back(std::clamp(rounded(static_cast<double>(k) * step_rad, 1e6), axis.min_rad, axis.max_rad));
  }
  std::stable_sort(out.begin(), out.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  return out;
}

base::Result<void> check(const ChoiceOptions& o) {
  // Each test is written so that NaN fails it.
  // Below 2 degrees a scan has more than 20 000 poses.
  if (!(o.apart_rad >= base::radians(2) && o.apart_rad <= base::radians(90))) {
    return fail(ErrorCode::bad_input,
                fmt::format("an angle of {:.3f} deg between poses is outside 2 to 90 deg",
                            base::degrees(o.apart_rad)));
  }
  if (!(o.step_rad >= base::radians(0.05) && o.step_rad <= o.apart_rad)) {
    return fail(
        ErrorCode::bad_input,
        fmt::format(
            "a walk in steps of {:.3f} deg is outside 0.05 deg to the angle between poses, {:.3f} deg",
            base::degrees(o.step_rad), base::degrees(o.apart_rad)));
  }
  for (const double steepest : {o.max_incident_rad, o.max_exitant_rad}) {
    if (!(steepest > 0 && steepest < base::kPi / 2)) {
      return fail(ErrorCode::bad_input,
                  fmt::format("a largest polar angle of {:.3f} deg is not between 0 and 90 deg",
                              base::degrees(steepest)));
    }
  }
  return {};
}

}  // namespace

base::Result<Choice> choose_poses(const machine::RigConfig& rig, const ChoiceOptions& options) {
  if (auto ok = check(options); !ok) return base::pass(ok);
  const auto tilts = stations(rig.axes[kTilt], options.step_rad);
  const auto pans = stations(rig.axes[kPan], options.step_rad);
  const auto arms = stations(rig.axes[kArm], options.step_rad);

  enum class Verdict : char { steep, near, far };
  Choice choice;
  PairGrid grid(options.apart_rad);
  std::vector<Verdict> verdicts(pans.size() * tilts.size());
  const auto station = [&](double arm, std::size_t i) {
    JointAngles angles{};
    angles[kRoll] = rig.axes[kRoll].home_rad;
    angles[kTilt] = tilts[i / pans.size()];
    angles[kPan] = pans[i % pans.size()];
    angles[kArm] = arm;
    return angles;
  };
  base::Progress progress("plan", arms.size(), "arm angles");
  for (const double arm : arms) {
    if (base::interrupted()) return base::interrupted_error("nothing was written");
    // All cores strike out what is too steep or near a pose of an earlier arm angle; what is left is few, and
    // decided in order.
    base::parallel_for(verdicts.size(), 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const IsotropicPair pair(machine::directions_at_centre(rig, station(arm, i)));
        const bool steep =
            pair.incident_rad() > options.max_incident_rad || pair.exitant_rad() > options.max_exitant_rad;
        verdicts[i] = steep ? Verdict::steep : grid.any_near(pair) ? Verdict::near : Verdict::far;
      }
    });
    for (std::size_t i = 0; i < verdicts.size(); ++i) {
      ++choice.walked;
      if (verdicts[i] == Verdict::steep) ++choice.too_steep;
      if (verdicts[i] != Verdict::far) continue;
      const JointAngles angles = station(arm, i);
      const IsotropicPair pair(machine::directions_at_centre(rig, angles));
      if (grid.any_near(pair)) continue;
      if (!machine::check_standing(rig, angles)) {
        ++choice.kept_out;
        continue;
      }
      grid.add(pair);
      choice.poses.push_back(angles);
      choice.pairs.push_back(pair);
    }
    progress.add();
  }
  if (choice.poses.empty()) {
    return fail(ErrorCode::refused, "the rig can reach no pose with these limits", {},
                "allow steeper light or view, or check the limits and keep-out rules of the rig");
  }
  return choice;
}

std::vector<double> stratified_rolls(const machine::AxisConfig& roll, std::size_t count, std::uint64_t seed) {
  const double range = std::min(roll.max_rad - roll.min_rad, 2 * base::kPi);
  const double lowest = 0.5 * (roll.min_rad + roll.max_rad - range);
  std::vector<double> out(count);
  base::Random random(base::derive_key(seed, 0));
  for (std::size_t i = 0; i < count; ++i) {
    const double angle =
        lowest + range * (static_cast<double>(i) + random.uniform()) / static_cast<double>(count);
    out[i] = std::clamp(rounded(angle, 1e3), roll.min_rad, roll.max_rad);
  }
  for (std::size_t i = count; i > 1; --i) std::swap(out[i - 1], out[random.below(i)]);
  return out;
}

}  // namespace rig::plan
