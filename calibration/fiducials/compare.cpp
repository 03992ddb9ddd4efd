#include "calibration/fiducials/compare.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <numbers>

namespace rig::calibration {

using geometry::Vec2;

namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::map<int, Vec2> centres(const std::vector<TagSighting>& tags) {
  std::map<int, int> times;
  for (const TagSighting& tag : tags) ++times[tag.id];
  std::map<int, Vec2> out;
  for (const TagSighting& tag : tags) {
    if (times[tag.id] != 1) continue;
    Vec2 sum;
    for (const Vec2& corner : tag.corners) {
      sum.x += corner.x / 4;
      sum.y += corner.y / 4;
    }
    out[tag.id] = sum;
  }
  return out;
}

}  // namespace

FiducialShift compare_fiducials(const std::vector<TagSighting>& before,
                                const std::vector<TagSighting>& after) {
  const auto first = centres(before);
  const auto second = centres(after);
  FiducialShift out;
  out.before = static_cast<int>(first.size());
  std::vector<std::pair<Vec2, Vec2>> pairs;
  std::vector<double> dx;
  std::vector<double> dy;
  for (const auto& [id, a] : first) {
    const auto found = second.find(id);
    if (found == second.end()) continue;
    const Vec2 b = found->second;
    pairs.emplace_back(a, b);
    dx.push_back(b.x - a.x);
    dy.push_back(b.y - a.y);
  }
  out.common = static_cast<int>(pairs.size());
  out.shift_px.x = median(dx);
  out.shift_px.y = median(dy);
  std::vector<double> turns;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = i + 1; j < pairs.size(); ++j) {
      const double from =
          std::atan2(pairs[j].first.y - pairs[i].first.y, pairs[j].first.x - pairs[i].first.x);
      const double to =
          std::atan2(pairs[j].second.y - pairs[i].second.y, pairs[j].second.x - pairs[i].second.x);
      turns.push_back(std::remainder(to - from, 2 * std::numbers::pi));
    }
  }
  out.turn_rad = median(turns);
  return out;
}

std::string what_moved(const FiducialShift& shift, const ShiftTolerance& tolerance) {
  if (2 * shift.common < shift.before || shift.common < 2) {
    return fmt::format("only {} of {} fiducials are seen again", shift.common, shift.before);
  }
  const double moved = std::hypot(shift.shift_px.x, shift.shift_px.y);
  if (!(moved <= tolerance.shift_px)) {
    return fmt::format("the fiducials stand {:.1f} pixels from where they stood, {:.1f} are allowed", moved,
                       tolerance.shift_px);
  }
  if (!(std::abs(shift.turn_rad) <= tolerance.turn_rad)) {
    constexpr double kDegrees = 180 / std::numbers::pi;
    return fmt::format("the fiducials are turned by {:.2f} deg, {:.2f} are allowed",
                       kDegrees * shift.turn_rad, kDegrees * tolerance.turn_rad);
  }
  return {};
}

}  // namespace rig::calibration
