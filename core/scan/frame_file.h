// One exposure on disk: a 16-bit TIFF of raw sensor values with its facts as one JSON object in
// ImageDescription. The same capture is the same bytes: DateTime is fixed, times of day live in the journal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/machine/pose.h"

namespace rig::scan {

struct FrameFacts {
  std::int64_t row = 0;  ///< of the plan
  int index = 0;         ///< within the bracket
  machine::JointAngles target_rad{};
  machine::JointAngles readback_rad{};
  double exposure_s = 0;  ///< as the camera says it was
  double gain = 1;
  std::string bayer;  ///< "RGGB", "none", ...
  int bits = 16;      ///< significant bits of a sample
};

struct Frame {
  FrameFacts facts;
  int width = 0, height = 0;
  std::vector<std::uint16_t> pixels;  ///< row-major, width * height
};

/// The bytes of the TIFF file.
[[nodiscard]] base::Result<std::vector<std::byte>> encode_frame(const FrameFacts& facts, int width,
                                                                int height, const std::uint16_t* pixels);
/// Reads a frame back; damage, a foreign TIFF and a newer version are errors that say so.
[[nodiscard]] base::Result<Frame> read_frame(const std::filesystem::path& path);
/// The same from the bytes of a file; `where` stands for it in messages.
[[nodiscard]] base::Result<Frame> decode_frame(std::span<const std::byte> bytes, const std::string& where);

}  // namespace rig::scan
