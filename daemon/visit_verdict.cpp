#include "daemon/visit_verdict.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rig::daemon {

namespace {

constexpr double kStrict = 0.8;
// Below it a patch is lost in the noise of the black level, and no ratio means anything.
constexpr double kLeastLit_dn = 8;

const scan::LookRecord* look_named(const scan::VisitRecord& visit, std::string_view name) {
  const auto found = std::find_if(visit.looks.begin(), visit.looks.end(),
                                  [name](const scan::LookRecord& look) { return look.name == name; });
  return found == visit.looks.end() ? nullptr : &*found;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

void compare_dark(const machine::ReferenceConfig& config, const scan::LookRecord& first,
                  const scan::LookRecord& now, double share, VisitVerdict& verdict) {
  verdict.dark_dn = mean_of(now.means_dn) - mean_of(first.means_dn);
  // A comparison that is false for what is not a number.
  if (verdict.dark_dn <= share * config.dark_dn) return;
  verdict.room_dark = false;
  verdict.what = fmt::format(
      "the room is not dark: the dark frame is {:.2f} DN above the first one's, {:.2f} are allowed",
      verdict.dark_dn, share * config.dark_dn);
}

void compare_patches(const machine::ReferenceConfig& config, const scan::LookRecord& first,
                     const scan::LookRecord& now, double share, VisitVerdict& verdict) {
  const auto complain = [&verdict](std::string what) {
    verdict.what += (verdict.what.empty() ? "" : "; ") + std::move(what);
  };
  if (now.means_dn.size() != first.means_dn.size()) {
    return complain(fmt::format("{} reference patches are seen, {} were at first", now.means_dn.size(),
                                first.means_dn.size()));
  }
  std::vector<double> ratios;
  for (std::size_t i = 0; i < now.means_dn.size(); ++i) ratios.push_back(now.means_dn[i] / first.means_dn[i]);
  verdict.level = mean_of(ratios);
  for (const double ratio : ratios)
    verdict.unevenness = std::max(verdict.unevenness, std::abs(ratio / verdict.level - 1));
  if (!(std::abs(verdict.level - 1) <= share * config.band)) {
    complain(fmt::format("the reference patches have {:.4f} of their first radiance, {:.4f} off is allowed",
                         verdict.level, share * config.band));
  }
  if (!(verdict.unevenness <= share * config.evenness)) {
    complain(fmt::format("the light is uneven: a patch departs by {:.4f} from the others, {:.4f} is allowed",
                         verdict.unevenness, share * config.evenness));
  }
}

}  // namespace

VisitVerdict judge_visit(const machine::ReferenceConfig& config,
                         const std::optional<scan::VisitRecord>& first, const scan::VisitRecord& now,
                         bool strict) {
  VisitVerdict verdict;
  const double share = strict ? kStrict : 1;
  const scan::LookRecord* patches = look_named(now, "patches");
  if (patches == nullptr || patches->means_dn.empty()) {
    verdict.what = "no reference patch is seen from [reference] pose_deg";
    return verdict;
  }
  for (const double mean : patches->means_dn) {
    if (mean >= kLeastLit_dn) continue;
    verdict.what = fmt::format(
        "a reference patch is {:.1f} DN above black; the light is out, or [reference] "
        "exposure_ms too short",
        mean);
  }
  if (!first) return verdict;
  const scan::LookRecord* dark = look_named(now, "dark");
  const scan::LookRecord* first_dark = look_named(*first, "dark");
  if (dark != nullptr && first_dark != nullptr) compare_dark(config, *first_dark, *dark, share, verdict);
  if (const scan::LookRecord* first_patches = look_named(*first, "patches"); first_patches != nullptr)
    compare_patches(config, *first_patches, *patches, share, verdict);
  return verdict;
}

}  // namespace rig::daemon
