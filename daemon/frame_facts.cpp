#include "daemon/frame_facts.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/srgb.h"

namespace rig::daemon {

namespace {

std::uint8_t to_srgb(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  const double encoded = base::srgb_from_linear(v);
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

// Where a row of pixels enters and leaves a polygon, in pairs.
std::vector<double> crossings(const std::vector<geometry::Vec2>& polygon, double y) {
  std::vector<double> out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const geometry::Vec2 a = polygon[i];
    const geometry::Vec2 b = polygon[(i + 1) % polygon.size()];
    if ((a.y <= y) == (b.y <= y)) continue;
    out.push_back(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Calls each(x, y, index) for every pixel whose centre is inside the polygon; for all where it is empty.
template <typename Each>
void for_each_inside(const machine::CameraConfig& camera, const std::vector<geometry::Vec2>& polygon,
                     Each&& each) {
  const int width = camera.intrinsics.width;
  const int height = camera.intrinsics.height;
  for (int y = 0; y < height; ++y) {
    std::vector<double> spans{-1.0, static_cast<double>(width)};
    if (!polygon.empty()) spans = crossings(polygon, y);
    for (std::size_t i = 0; i + 1 < spans.size(); i += 2) {
      const int from = static_cast<int>(std::ceil(std::clamp(spans[i], -1.0, static_cast<double>(width))));
      const int to = static_cast<int>(std::floor(std::clamp(spans[i + 1], -1.0, static_cast<double>(width))));
      for (int x = std::max(from, 0); x <= std::min(to, width - 1); ++x) {
        each(x, y,
             static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
      }
    }
  }
}

}  // namespace

double saturated_share(const machine::CameraConfig& camera, std::span<const std::uint16_t> pixels,
                       const std::vector<geometry::Vec2>& polygon) {
  std::size_t seen = 0;
  std::size_t saturated = 0;
  for_each_inside(camera, polygon, [&](int /*x*/, int /*y*/, std::size_t i) {
    ++seen;
    if (pixels[i] >= camera.sensor.saturation_dn) ++saturated;
  });
  return seen == 0 ? 0 : static_cast<double>(saturated) / static_cast<double>(seen);
}

std::optional<double> mean_above_black_dn(const machine::CameraConfig& camera,
                                          std::span<const std::uint16_t> pixels,
                                          const std::vector<geometry::Vec2>& polygon) {
  constexpr auto kGreen = 1;
  const bool mosaic = camera.bayer != geometry::BayerPattern::none;
  double sum = 0;
  std::size_t seen = 0;
  for_each_inside(camera, polygon, [&](int x, int y, std::size_t i) {
    if (mosaic && static_cast<int>(geometry::colour_at(camera.bayer, x, y)) != kGreen) return;
    sum += pixels[i];
    ++seen;
  });
  if (seen == 0) return std::nullopt;
  return sum / static_cast<double>(seen) - camera.sensor.black_dn;
}

SampleHistogram sample_histogram(const machine::CameraConfig& camera, std::span<const std::uint16_t> pixels,
                                 const std::vector<geometry::Vec2>& polygon) {
  const auto top = static_cast<std::size_t>(std::ceil(std::clamp(camera.sensor.saturation_dn, 0.0, 65535.0)));
  SampleHistogram histogram;
  for_each_inside(camera, polygon, [&](int x, int y, std::size_t i) {
    auto& list = histogram.counts[static_cast<std::size_t>(geometry::colour_at(camera.bayer, x, y))];
    if (list.empty()) list.resize(top + 1);
    ++list[std::min<std::size_t>(pixels[i], top)];
  });
  return histogram;
}

Preview make_preview(const machine::CameraConfig& camera, std::span<const std::uint16_t> pixels, int widest) {
  const int width = camera.intrinsics.width;
  const int height = camera.intrinsics.height;
  const int cell = std::max(2, 2 * ((width + 2 * widest - 1) / (2 * widest)));
  Preview preview{width / cell, height / cell, {}};
  preview.rgb.reserve(static_cast<std::size_t>(preview.width) * static_cast<std::size_t>(preview.height) * 3);
  const double full = camera.sensor.saturation_dn - camera.sensor.black_dn;
  for (int v = 0; v < preview.height; ++v) {
    for (int u = 0; u < preview.width; ++u) {
      std::array<double, 3> sum{};
      std::array<int, 3> count{};
      // One mosaic cell stands for its neighbours: a preview need not be smooth.
      for (int dy = 0; dy < 2; ++dy) {
        for (int dx = 0; dx < 2; ++dx) {
          const int x = u * cell + dx;
          const int y = v * cell + dy;
          const auto c = static_cast<std::size_t>(geometry::colour_at(camera.bayer, x, y));
          sum[c] += pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(x)] -
                    camera.sensor.black_dn;
          ++count[c];
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t from = count[c] > 0 ? c : 1;  // a grey sensor has green alone
        preview.rgb.push_back(to_srgb(camera.white_balance[c] * sum[from] / std::max(count[from], 1) / full));
      }
    }
  }
  return preview;
}

}  // namespace rig::daemon
