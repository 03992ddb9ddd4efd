// A stack of photographs of a flat sample whose camera and light positions somebody else measured, in the
// layouts that are common for them. Reading a layout reads no image.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::import {

/// One photograph, already rectified: it shows exactly the sample, y of the sample frame upwards.
struct Photograph {
  std::filesystem::path file;
  std::array<double, 3> camera_m{};
  std::array<double, 4> light_m{};  ///< homogeneous: w = 1 a point, w = 0 a direction
};

struct Stack {
  std::vector<Photograph> photographs;
  double width_m = 0;  ///< of the sample; 0: the layout does not say
  /// Intensity of the light in each channel: irradiance of decoded values at 1 m, or of a light that is a
  /// direction.
  std::array<double, 3> light_power{1, 1, 1};
  std::string layout;  ///< for provenance
};

/// A folder with `camera_pos.txt` and `light_pos.txt` (a line "x,y,z" per image, sample centre at the origin,
/// z its normal), `image_size.txt` (width of the sample), `light_power.txt` (one line "r,g,b": irradiance at
/// one unit of length) and the images in the order of their names (00.png, 01.png, ...). `unit_m` is the
/// length that the files count in: 0.01 for centimetres. Errors name file and line.
[[nodiscard]] base::Result<Stack> read_positions_layout(const std::filesystem::path& folder, double unit_m);

/// Reflectance transformation imaging: an `.lp` file with the number of images in its first line, then a line
/// "file x y z" each with the direction to the light (x right, y up, z to the camera; any length but zero).
/// Files are looked for as written, then by their name alone beside the `.lp`. The camera stands on the
/// normal through the centre, `camera_distance_m` away. Errors name file and line.
[[nodiscard]] base::Result<Stack> read_lp_layout(const std::filesystem::path& file, double camera_distance_m);

/// The layout that a path has: a folder with one `.lp`, an `.lp` file, or a folder with `camera_pos.txt`.
/// Nothing that is known is an error that names both.
enum class Layout { positions, lp };
struct FoundLayout {
  Layout layout;
  std::filesystem::path path;  ///< of the folder, or of the `.lp` file
};
[[nodiscard]] base::Result<FoundLayout> find_layout(const std::filesystem::path& path);

}  // namespace rig::import
