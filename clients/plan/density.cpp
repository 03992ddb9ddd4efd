#include "clients/plan/density.h"

#include <cmath>

#include "core/base/units.h"

namespace rig::plan {

using base::ErrorCode;
using base::fail;
using base::kPi;

base::Result<Density> density_for(double sharpness, double threshold, double per_highlight) {
  // Each test is written so that NaN fails it.
  if (!(sharpness > 0 && sharpness <= 1e9)) {
    return fail(ErrorCode::bad_input, fmt::format("sharpness {} is not in (0, 1e9]", sharpness));
  }
  if (!(threshold > 0 && threshold < 1)) {
    return fail(ErrorCode::bad_input, fmt::format("threshold {} is not between 0 and 1", threshold), {},
                "0.3 is usual: where the highlight has fallen to 30 %");
  }
  if (!(per_highlight > 0 && per_highlight <= 1e6)) {
    return fail(ErrorCode::bad_input,
                fmt::format("{} samples per highlight is not in (0, 1e6]", per_highlight));
  }
  Density d;
  d.highlight_rad = std::acos(std::pow(threshold, 1 / sharpness));
  // 1 - cos, without the cancellation at sharp highlights.
  d.hemisphere_share = -std::expm1(std::log(threshold) / sharpness);
  d.poses = per_highlight / d.hemisphere_share;
  const double zeta_sr = 2 * kPi * d.hemisphere_share;  // the highlight's solid angle
  d.apart_2d_rad = std::sqrt(zeta_sr / per_highlight);
  d.apart_3d_rad = std::cbrt(kPi / 2 * zeta_sr / per_highlight);
  d.apart_4d_rad = std::pow(2 * kPi * zeta_sr / per_highlight, 0.25);
  return d;
}

}  // namespace rig::plan
