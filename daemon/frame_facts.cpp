#include "daemon/frame_facts.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "core/base/srgb.h"

namespace rig::daemon {

namespace {

std::uint8_t to_srgb(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  const double encoded = base::srgb_from_linear(v);
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

// The code of each raw value by its first 12 bits; those behind them change it by one at most.
constexpr int kCodeBits = 12;
using Codes = std::array<std::uint8_t, std::size_t{1} << kCodeBits>;

// How far a raw value is shifted to be an index of Codes.
int code_shift(const machine::CameraConfig& camera) {
  return std::max(0, camera.sensor.bits - kCodeBits);
}

Codes codes_of(const machine::CameraConfig& camera, std::size_t colour) {
  const double full = camera.sensor.saturation_dn - camera.sensor.black_dn;
  const int shift = code_shift(camera);
  Codes codes{};
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const auto raw = static_cast<double>(i << shift);
    codes[i] = to_srgb(camera.white_balance[colour] * (raw - camera.sensor.black_dn) / full);
  }
  return codes;
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
  preview.rgb.resize(static_cast<std::size_t>(preview.width) * static_cast<std::size_t>(preview.height) * 3);
  // One mosaic cell stands for its neighbours: a preview need not be smooth. All cells begin at even pixels,
  // so that they have the same colours; of each the mean of the raw values is what is looked up. The loop
  // makes the previews, and a stop may wait for it: no power is taken for a pixel.
  std::array<std::array<std::uint32_t, 4>, 3> weights{};
  for (int i = 0; i < 4; ++i) {
    const auto colour = static_cast<std::size_t>(geometry::colour_at(camera.bayer, i % 2, i / 2));
    weights[colour][static_cast<std::size_t>(i)] = 1;
  }
  struct Channel {
    std::array<std::uint32_t, 4> weights;
    int shift;
    Codes codes;
  };
  std::array<Channel, 3> channels;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto samples = [](const auto& of) { return std::accumulate(of.begin(), of.end(), 0U); };
    const auto& from = samples(weights[c]) > 0 ? weights[c] : weights[1];  // a grey sensor has green alone
    channels[c] = {from, std::countr_zero(samples(from)) + code_shift(camera), codes_of(camera, c)};
  }
  const auto row = static_cast<std::size_t>(width);
  auto out = preview.rgb.begin();
  for (int v = 0; v < preview.height; ++v) {
    const std::uint16_t* at = pixels.data() + static_cast<std::size_t>(v * cell) * row;
    for (int u = 0; u < preview.width; ++u, at += cell) {
      const std::array<std::uint32_t, 4> raw{at[0], at[1], at[row], at[row + 1]};
      for (const Channel& channel : channels) {
        const auto& w = channel.weights;
        const std::uint32_t sum = w[0] * raw[0] + w[1] * raw[1] + w[2] * raw[2] + w[3] * raw[3];
        *out++ = channel.codes[std::min<std::size_t>(sum >> channel.shift, channel.codes.size() - 1)];
      }
    }
  }
  return preview;
}

}  // namespace rig::daemon
