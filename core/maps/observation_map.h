// The observation map: for every texel what was seen of it in every pose (Mortensen and Andersen 2007, 9;
// McAllister 2002, 3.6). HDF5 (docs/file-formats.md): datasets over (row, column, pose, channel) chunked in
// tiles of texels with all their poses; the geometry once per pose. It never needs to fit in memory.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::maps {

/// What a value is.
enum class Quantity {
  brdf,      ///< sr^-1; relative (one unknown factor for the whole map) unless `absolute`
  radiance,  ///< relative radiance under static light
};

/// Geometry of one pose in the sample frame, metres. Directions and distances of a texel follow from it.
struct PoseGeometry {
  std::int64_t row = 0;                ///< of the scan's plan, or the number of the imported image
  std::array<double, 3> camera_m{};    ///< centre of projection
  std::array<double, 4> light_m{};     ///< homogeneous: (x, y, z, 1) a point, (x, y, z, 0) a direction
  std::array<double, 4> target_rad{};  ///< roll, tilt, pan, arm as commanded; NaN where there were no motors
  std::array<double, 12>
      camera_from_sample{};        ///< 3 x 4, row-major, camera frame of OpenCV; NaN if not known
  double registration_rms_px = 0;  ///< residual of the fiducials; NaN if not registered by fiducials
};

struct ObservationHeader {
  int columns = 0, rows = 0;         ///< S, T
  double width_m = 0, height_m = 0;  ///< of the sample
  Quantity quantity = Quantity::brdf;
  bool absolute = false;                          ///< scaled by a reference of known reflectance
  std::string name;                               ///< of the sample
  std::map<std::string, std::string> provenance;  ///< free: program, scan, command
  std::vector<PoseGeometry> poses;
};

/// Why a value is or is not usable.
enum class Validity : std::uint8_t {
  missing = 0,  ///< not seen: outside the image, behind, or the light below the horizon
  good = 1,
  saturated = 2,  ///< the value is a lower bound
  dark = 3,       ///< below the noise in every exposure; value and variance are still right
};

/// A rectangle of texels with all poses. Index of (t, s, pose, channel): ((t * columns + s) * poses + pose) *
/// 3 + c, with t and s counted from the rectangle's first.
struct ObservationBlock {
  int first_row = 0, rows = 0;
  int first_column = 0, columns = 0;
  int poses = 0;
  std::vector<float> value;        ///< linear sRGB channel order R, G, B
  std::vector<float> variance;     ///< of value, same shape
  std::vector<Validity> validity;  ///< one per (t, s, pose)

  [[nodiscard]] std::size_t texel_index(int t, int s) const {
    return (static_cast<std::size_t>(t) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(s)) *
           static_cast<std::size_t>(poses);
  }
  /// Sizes the vectors for the rectangle, with everything missing.
  void allocate();
};

/// Edge of a tile, texels: the chunks of the file are kTile x kTile x poses x 3 (smaller where that would
/// reach HDF5's limit of 4 GiB, beyond 1.3 million poses).
inline constexpr int kTile = 16;

class ObservationWriter {
 public:
  /// Writes to `<path>.part` until finish(); an existing `path` stays until then. A writer destroyed before
  /// that removes its part; one that was killed leaves it, and the next one for this path replaces it.
  [[nodiscard]] static base::Result<ObservationWriter> create(const std::filesystem::path& path,
                                                              const ObservationHeader& header);
  ObservationWriter(ObservationWriter&&) noexcept;
  ObservationWriter& operator=(ObservationWriter&&) noexcept;
  ~ObservationWriter();

  /// Any rectangle with all its poses, in any order; whole tiles (edges of the map excepted) are fast. What
  /// is never written reads as missing.
  [[nodiscard]] base::Result<void> write(const ObservationBlock& block);
  /// Closes, flushes and renames to the final name. Without it nothing appears under that name.
  [[nodiscard]] base::Result<void> finish();

 private:
  struct State;
  explicit ObservationWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

class ObservationReader {
 public:
  /// Refuses files that are no observation map, damaged ones and newer versions, each with its reason.
  [[nodiscard]] static base::Result<ObservationReader> open(const std::filesystem::path& path);
  ObservationReader(ObservationReader&&) noexcept;
  ObservationReader& operator=(ObservationReader&&) noexcept;
  ~ObservationReader();

  [[nodiscard]] const ObservationHeader& header() const;
  /// Any rectangle inside the map. Not safe to call from several threads at once, also not on two readers:
  /// the HDF5 library has one state.
  [[nodiscard]] base::Result<ObservationBlock> read(int first_row, int rows, int first_column,
                                                    int columns) const;
  /// One pose of the whole map as rows * columns * 3 values, and its validity. Touches every tile, so it
  /// reads the whole file.
  [[nodiscard]] base::Result<ObservationBlock> read_pose(int pose) const;

 private:
  struct State;
  explicit ObservationReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::maps
