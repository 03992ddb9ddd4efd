#include "clients/rig/live_measure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/srgb.h"

namespace rig::client {

namespace {

constexpr double kLevelShare = 0.999;
// The farthest that one step goes: a frame far from the good level tells little.
constexpr double kLongestStep = 8;
constexpr double kStepFromSaturation = 0.25;

std::size_t at(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

struct Counts {
  std::vector<std::size_t> of_value;
  std::size_t sum = 0;
};

Exposed exposed(const Counts& counts, double black, double saturation) {
  Exposed out;
  if (counts.sum == 0) return out;
  std::size_t saturated = 0;
  std::size_t dark = 0;
  std::size_t so_far = 0;
  const auto wanted = static_cast<std::size_t>(std::ceil(kLevelShare * static_cast<double>(counts.sum)));
  for (std::size_t value = 0; value < counts.of_value.size(); ++value) {
    const std::size_t count = counts.of_value[value];
    const auto dn = static_cast<double>(value);
    if (dn >= saturation) saturated += count;
    if (dn <= black) dark += count;
    if (so_far < wanted && so_far + count >= wanted)
      out.level = std::clamp((dn - black) / (saturation - black), 0.0, 1.0);
    so_far += count;
  }
  out.saturated_share = static_cast<double>(saturated) / static_cast<double>(counts.sum);
  out.black_share = static_cast<double>(dark) / static_cast<double>(counts.sum);
  return out;
}

const std::array<float, 256>& linear_values() {
  static const auto kValues = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
      values.at(i) = static_cast<float>(base::linear_from_srgb(static_cast<double>(i) / 255));
    return values;
  }();
  return kValues;
}

}  // namespace

Region region_around(const std::vector<geometry::Vec2>& polygon, int width, int height) {
  const Region whole{0, 0, width, height};
  if (polygon.empty()) return whole;
  const auto [left, right] = std::minmax_element(polygon.begin(), polygon.end(),
                                                 [](const auto& a, const auto& b) { return a.x < b.x; });
  const auto [top, bottom] = std::minmax_element(polygon.begin(), polygon.end(),
                                                 [](const auto& a, const auto& b) { return a.y < b.y; });
  const auto within = [](double v, int end) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(end)));
  };
  const Region region{within(std::floor(left->x), width), within(std::floor(top->y), height),
                      within(std::ceil(right->x) + 1, width), within(std::ceil(bottom->y) + 1, height)};
  return region.width() > 0 && region.height() > 0 ? region : whole;
}

Plane green_of_mosaic(std::span<const std::uint16_t> mosaic, int width, geometry::BayerPattern pattern,
                      const geometry::SensorModel& sensor, const Region& region) {
  const auto value = [&](int x, int y) {
    return static_cast<float>((mosaic[at(x, y, width)] - sensor.black_dn) /
                              (sensor.saturation_dn - sensor.black_dn));
  };
  Plane plane;
  if (pattern == geometry::BayerPattern::none) {
    plane = {region.width(), region.height(), {}};
    for (int y = region.y0; y < region.y1; ++y) {
      for (int x = region.x0; x < region.x1; ++x) plane.pixels.push_back(value(x, y));
    }
    return plane;
  }
  // Whole cells; one diagonal of each is green.
  const bool on_main = geometry::colour_at(pattern, 0, 0) == geometry::Colour::green;
  const int left = (region.x0 + 1) / 2 * 2;
  const int top = (region.y0 + 1) / 2 * 2;
  plane = {std::max(0, (region.x1 - left) / 2), std::max(0, (region.y1 - top) / 2), {}};
  for (int v = 0; v < plane.height; ++v) {
    for (int u = 0; u < plane.width; ++u) {
      const int x = left + 2 * u;
      const int y = top + 2 * v;
      plane.pixels.push_back(0.5F * (value(on_main ? x : x + 1, y) + value(on_main ? x + 1 : x, y + 1)));
    }
  }
  return plane;
}

Plane green_of_preview(const protocol::Frame& frame, const Region& region) {
  Plane plane{region.width(), region.height(), {}};
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      const std::size_t i = 3 * at(x, y, static_cast<int>(frame.preview_width())) + 1;
      plane.pixels.push_back(linear_values().at(static_cast<unsigned char>(frame.preview_rgb()[i])));
    }
  }
  return plane;
}

double focus_measure(const Plane& plane) {
  if (plane.width < 3 || plane.height < 3) return 0;
  double sum = 0;
  for (const float v : plane.pixels) sum += static_cast<double>(v);
  const double mean = sum / static_cast<double>(plane.pixels.size());
  if (!(mean > 0)) return 0;
  double energy = 0;
  const auto value = [&plane](int x, int y) {
    return static_cast<double>(plane.pixels[at(x, y, plane.width)]);
  };
  for (int y = 1; y + 1 < plane.height; ++y) {
    for (int x = 1; x + 1 < plane.width; ++x) {
      const double across = value(x + 1, y - 1) - value(x - 1, y - 1) +
                            2 * (value(x + 1, y) - value(x - 1, y)) + value(x + 1, y + 1) -
                            value(x - 1, y + 1);
      const double down = value(x - 1, y + 1) - value(x - 1, y - 1) +
                          2 * (value(x, y + 1) - value(x, y - 1)) + value(x + 1, y + 1) - value(x + 1, y - 1);
      energy += (across * across + down * down) / 64;
    }
  }
  const double inner = static_cast<double>(plane.width - 2) * static_cast<double>(plane.height - 2);
  return 1000 * energy / inner / (mean * mean);
}

Exposed exposed_of_mosaic(std::span<const std::uint16_t> mosaic, int width,
                          const geometry::SensorModel& sensor, const Region& region) {
  Counts counts{std::vector<std::size_t>(65536), 0};
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) ++counts.of_value[mosaic[at(x, y, width)]];
  }
  counts.sum = static_cast<std::size_t>(region.width()) * static_cast<std::size_t>(region.height());
  return exposed(counts, sensor.black_dn, sensor.saturation_dn);
}

Exposed exposed_of_preview(const protocol::Frame& frame, const Region& region) {
  Counts counts{std::vector<std::size_t>(256), 0};
  for (int y = region.y0; y < region.y1; ++y) {
    for (int x = region.x0; x < region.x1; ++x) {
      const std::size_t i = 3 * at(x, y, static_cast<int>(frame.preview_width()));
      for (std::size_t c = 0; c < 3; ++c)
        ++counts.of_value[static_cast<unsigned char>(frame.preview_rgb()[i + c])];
    }
  }
  counts.sum = 3 * static_cast<std::size_t>(region.width()) * static_cast<std::size_t>(region.height());
  Exposed out = exposed(counts, 0, 255);
  out.level = base::linear_from_srgb(out.level);
  return out;
}

double better_exposure(double exposure, double level) {
  if (level >= 1) return exposure * kStepFromSaturation;
  if (std::abs(level - kGoodLevel) <= kLevelTolerance) return exposure;
  return exposure * std::min(kLongestStep, kGoodLevel / std::max(level, 1e-6));
}

}  // namespace rig::client
