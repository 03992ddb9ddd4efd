#include "sim/wire/gv_pattern.h"

#include <algorithm>
#include <array>
#include <vector>

namespace rig::sim::wire {

namespace {

constexpr std::uint32_t kAcross = 7, kDown = 13;

std::uint32_t start_of(const PatternFacts& facts) {
  std::uint32_t h =
      facts.exposure_us * 2654435761U ^ (facts.frame + 1) * 2246822519U ^ facts.gain * 3266489917U;
  h ^= h >> 15;
  return h;
}

std::array<std::uint8_t, kPatternHeader> header_of(const PatternFacts& facts) {
  std::array<std::uint8_t, kPatternHeader> header{};
  for (std::size_t i = 0; i < 4; ++i) {
    header[i] = static_cast<std::uint8_t>(facts.exposure_us >> (8 * i));
    header[4 + i] = static_cast<std::uint8_t>(facts.frame >> (8 * i));
  }
  header[8] = static_cast<std::uint8_t>(facts.gain);
  for (std::size_t i = 0; i < 9; ++i) header[9] = static_cast<std::uint8_t>(header[9] + header[i]);
  header[10] = 0x5a;
  header[11] = 0xa5;
  return header;
}

template <typename Sample>
std::optional<PatternFacts> read_samples(std::span<const Sample> samples, std::size_t width, int bits) {
  if (samples.size() < kPatternHeader || width < kPatternHeader) return std::nullopt;
  PatternFacts facts;
  for (std::size_t i = 0; i < 4; ++i) {
    facts.exposure_us |= static_cast<std::uint32_t>(samples[i] & 0xff) << (8 * i);
    facts.frame |= static_cast<std::uint32_t>(samples[4 + i] & 0xff) << (8 * i);
  }
  facts.gain = samples[8] & 0xff;
  std::vector<std::uint16_t> wide(width);
  std::vector<Sample> expected(width);
  for (std::size_t line = 0; line * width < samples.size(); ++line) {
    paint_pattern_line(facts, bits, line, wide);
    std::transform(wide.begin(), wide.end(), expected.begin(),
                   [](std::uint16_t v) { return static_cast<Sample>(v); });
    const auto got = samples.subspan(line * width, std::min(width, samples.size() - line * width));
    if (!std::equal(got.begin(), got.end(), expected.begin())) return std::nullopt;
  }
  return facts;
}

}  // namespace

void paint_pattern_line(const PatternFacts& facts, int bits, std::size_t line,
                        std::span<std::uint16_t> samples) {
  const std::uint32_t mask = (1U << static_cast<unsigned>(bits)) - 1;
  const std::uint32_t start = start_of(facts) + kDown * static_cast<std::uint32_t>(line);
  for (std::size_t x = 0; x < samples.size(); ++x) {
    samples[x] = static_cast<std::uint16_t>((start + kAcross * static_cast<std::uint32_t>(x)) & mask);
  }
  if (line != 0) return;
  const auto header = header_of(facts);
  std::copy_n(header.begin(), std::min(header.size(), samples.size()), samples.begin());
}

std::optional<PatternFacts> read_pattern(std::span<const std::uint16_t> samples, std::size_t width,
                                         int bits) {
  return read_samples(samples, width, bits);
}

std::optional<PatternFacts> read_pattern(std::span<const std::uint8_t> samples, std::size_t width) {
  return read_samples(samples, width, 8);
}

}  // namespace rig::sim::wire
