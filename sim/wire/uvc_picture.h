// The picture of the simulated USB video camera: brightness as of light that was gathered, and in its first
// row what it was taken with.
//
// On a scale of 16 bits a sample in column x of a picture W wide is
//   min(65535, 16 brightness + exposure_100us gain (1 + floor(8 x / W)) light / 256)
// with the quotient rounded down: eight bands, the darkest on the left, in which the exposure times the gain
// can be measured. In a Bayer picture the light is divided by 2 at red places and by 4 at blue ones, before
// it is added. Formats with less than 16 bits have the upper ones. The first samples of row 0 are bits
// instead, three quarters of the full scale or one, the least significant first: frame number (32),
// exposure_100us (32), gain (16), brightness (16), light (16).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/wire/uvc_controls.h"
#include "sim/wire/uvc_format.h"

namespace rig::sim::wire {

/// What the scene gives: 256 is its daylight, 0 is darkness.
inline constexpr std::uint32_t kUvcDaylight = 256, kUvcMostLight = 4096;

struct UvcPictureFacts {
  std::uint32_t frame = 0;
  UvcSettings settings;
  std::uint32_t light = kUvcDaylight;
  [[nodiscard]] bool operator==(const UvcPictureFacts&) const = default;
};

/// The bytes of a frame.
[[nodiscard]] std::vector<std::uint8_t> paint_uvc_picture(const UvcPictureFacts& facts,
                                                          const UvcFormat& format, const UvcSize& size);
/// What a frame says; nothing where its size is wrong or a single sample contradicts it.
[[nodiscard]] std::optional<UvcPictureFacts> read_uvc_picture(std::span<const std::uint8_t> frame,
                                                              const UvcFormat& format, const UvcSize& size);

}  // namespace rig::sim::wire
