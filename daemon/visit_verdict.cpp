#include "daemon/visit_verdict.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

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

void complain(VisitVerdict& verdict, std::string what) {
  verdict.what += (verdict.what.empty() ? "" : "; ") + std::move(what);
}

void compare_dark(const machine::ReferenceConfig& config, const scan::LookRecord& first,
                  const scan::LookRecord& now, double share, VisitVerdict& verdict) {
  verdict.dark_dn = mean_of(now.means_dn) - mean_of(first.means_dn);
  // A comparison that is false for what is not a number.
  if (verdict.dark_dn <= share * config.dark_dn) return;
  verdict.room_dark = false;
  complain(verdict, fmt::format("the room is not dark: the dark frame is {:.2f} DN above the first one's, "
                                "{:.2f} are allowed",
                                verdict.dark_dn, share * config.dark_dn));
}

// How what was as bright everywhere as at first has changed: all of it, and one part against the others.
struct Change {
  double level = 0, unevenness = 0;
};
Change change_of(const std::vector<double>& first, const std::vector<double>& now) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < now.size(); ++i) ratios.push_back(now[i] / first[i]);
  Change change;
  change.level = mean_of(ratios);
  for (const double ratio : ratios)
    change.unevenness = std::max(change.unevenness, std::abs(ratio / change.level - 1));
  return change;
}

// What is compared, in words: many of it, all of it, one of it.
struct Words {
  const char *many, *all_have, *their, *one;
};
constexpr Words kPatches{"reference patches", "the reference patches have", "their", "a patch"};
constexpr Words kFlat{"parts of the flat", "the flat has", "its", "a part of the flat"};

std::optional<Change> compare(const Words& words, const scan::LookRecord& first, const scan::LookRecord& now,
                              double band, double evenness, VisitVerdict& verdict) {
  if (now.means_dn.size() != first.means_dn.size()) {
    complain(verdict, fmt::format("{} {} are seen, {} were at first", now.means_dn.size(), words.many,
                                  first.means_dn.size()));
    return std::nullopt;
  }
  const Change change = change_of(first.means_dn, now.means_dn);
  // Comparisons that are false for what is not a number.
  if (!(std::abs(change.level - 1) <= band)) {
    complain(verdict, fmt::format("{} {:.4f} of {} first radiance, {:.4f} off is allowed", words.all_have,
                                  change.level, words.their, band));
  }
  if (!(change.unevenness <= evenness)) {
    complain(verdict,
             fmt::format("the light is uneven: {} departs by {:.4f} from the others, {:.4f} is allowed",
                         words.one, change.unevenness, evenness));
  }
  return change;
}

// Whether there is light enough for ratios to mean something.
void check_lit(const machine::ReferenceConfig& config, const scan::LookRecord& patches,
               const scan::LookRecord* flat, VisitVerdict& verdict) {
  const auto darkest = [](const scan::LookRecord& look) {
    return *std::min_element(look.means_dn.begin(), look.means_dn.end());
  };
  if (const double dn = darkest(patches); !(dn >= kLeastLit_dn)) {
    complain(verdict, fmt::format("a reference patch is {:.1f} DN above black; the light is out, or "
                                  "[reference] exposure_ms too short",
                                  dn));
  }
  if (!config.flat || flat == nullptr) return;
  if (flat->means_dn.empty()) return complain(verdict, "nothing of the flat is inside the image");
  if (const double dn = darkest(*flat); !(dn >= kLeastLit_dn)) {
    complain(verdict, fmt::format("a part of the flat is {:.1f} DN above black; the light is out, or "
                                  "[reference.flat] exposure_ms too short",
                                  dn));
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
  const scan::LookRecord* flat = look_named(now, "flat");
  check_lit(config, *patches, flat, verdict);
  if (!first) return verdict;
  const scan::LookRecord* dark = look_named(now, "dark");
  const scan::LookRecord* first_dark = look_named(*first, "dark");
  if (dark != nullptr && first_dark != nullptr) compare_dark(config, *first_dark, *dark, share, verdict);
  if (const scan::LookRecord* first_patches = look_named(*first, "patches"); first_patches != nullptr) {
    const auto change =
        compare(kPatches, *first_patches, *patches, share * config.band, share * config.evenness, verdict);
    if (change) std::tie(verdict.level, verdict.unevenness) = std::tie(change->level, change->unevenness);
  }
  // One that an earlier rig.toml did not ask for is nothing to compare with.
  const scan::LookRecord* first_flat = look_named(*first, "flat");
  if (config.flat && flat != nullptr && first_flat != nullptr) {
    const auto change =
        compare(kFlat, *first_flat, *flat, share * config.flat->band, share * config.flat->evenness, verdict);
    if (change)
      std::tie(verdict.flat_level, verdict.flat_unevenness) = std::tie(change->level, change->unevenness);
  }
  return verdict;
}

}  // namespace rig::daemon
