#include "sim/wire/video_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace rig::sim::wire {

namespace {

// Half of full brightness: so many microseconds at gain 0 and a light of 100.
constexpr double kHalf_us = 4000;
constexpr double kBrightest = 0.9;
constexpr double kGainDoubles = 16;
constexpr std::uint32_t kTexture = 3;

std::uint32_t level_of(const VideoFacts& facts, int bits) {
  const double exposed = facts.exposure_us * (1 + facts.gain / kGainDoubles) * facts.light / 100.0;
  const double most = kBrightest * ((1 << bits) - 1) - kTexture;
  return static_cast<std::uint32_t>(std::lround(most * exposed / (exposed + kHalf_us)));
}

std::array<std::uint8_t, kVideoHeader> header_of(const VideoFacts& facts) {
  std::array<std::uint8_t, kVideoHeader> header{};
  for (unsigned i = 0; i < 4; ++i) {
    header[i] = static_cast<std::uint8_t>(facts.exposure_us >> (8 * i));
    header[4 + i] = static_cast<std::uint8_t>(facts.frame >> (8 * i));
  }
  header[8] = facts.gain;
  header[9] = facts.light;
  for (std::size_t i = 0; i < 10; ++i) header[10] = static_cast<std::uint8_t>(header[10] + header[i]);
  header[11] = 0xa5;
  return header;
}

}  // namespace

void paint_video_line(const VideoFacts& facts, int bits, std::size_t line, std::span<std::uint16_t> samples) {
  const std::uint32_t level = level_of(facts, bits);
  const std::uint32_t start = facts.exposure_us + facts.frame + facts.gain + static_cast<std::uint32_t>(line);
  for (std::size_t x = 0; x < samples.size(); ++x) {
    samples[x] = static_cast<std::uint16_t>(level + ((start + static_cast<std::uint32_t>(x)) & kTexture));
  }
  if (line != 0) return;
  const auto header = header_of(facts);
  std::copy_n(header.begin(), std::min(header.size(), samples.size()), samples.begin());
}

std::optional<VideoFacts> read_video(std::span<const std::uint16_t> samples, std::size_t width, int bits) {
  if (samples.size() < width || width < kVideoHeader || samples.size() % width != 0) return std::nullopt;
  VideoFacts facts;
  for (unsigned i = 0; i < 4; ++i) {
    facts.exposure_us |= static_cast<std::uint32_t>(samples[i] & 0xff) << (8 * i);
    facts.frame |= static_cast<std::uint32_t>(samples[4 + i] & 0xff) << (8 * i);
  }
  facts.gain = static_cast<std::uint8_t>(samples[8]);
  facts.light = static_cast<std::uint8_t>(samples[9]);
  std::vector<std::uint16_t> expected(width);
  for (std::size_t line = 0; line * width < samples.size(); ++line) {
    paint_video_line(facts, bits, line, expected);
    if (!std::equal(expected.begin(), expected.end(),
                    samples.begin() + static_cast<std::ptrdiff_t>(line * width))) {
      return std::nullopt;
    }
  }
  return facts;
}

}  // namespace rig::sim::wire
