// Rectification: from the image of a tilted plane to a map of that plane, colour by colour, straight from the
// mosaic.
#pragma once

#include <cstdint>
#include <vector>

#include "calibration/hdr_merge.h"
#include "core/geometry/camera.h"
#include "core/geometry/sample_grid.h"
#include "core/geometry/sensor.h"
#include "core/geometry/vec.h"

namespace rig::calibration {

enum class TexelState : std::uint8_t {
  missing,  ///< outside the image, or the plane is seen from behind
  good,
  saturated,  ///< a sample in it is: the value is a lower bound
};

/// Some rows of a map of the sample plane, row-major.
struct RectifiedRows {
  int first_row = 0, rows = 0, columns = 0;
  std::vector<float> value;     ///< three a texel: red, green, blue; unit of the image
  std::vector<float> variance;  ///< of value
  std::vector<TexelState> state;
};

/// The pixels that `rectify` needs for these rows: their bounding box with a margin, cut to the image. Empty
/// where none is in the image.
[[nodiscard]] PixelRect pixels_of_rows(const geometry::CameraIntrinsics& camera,
                                       const geometry::RigidTransform& camera_from_sample,
                                       const geometry::SampleGrid& grid, int first_row, int rows);

/// The value of a texel is the mean over its parallelogram in the image of each colour's own samples,
/// interpolated bilinearly in that colour's lattice: every second pixel of every second row for red and blue,
/// the quincunx for green. The mean is taken at points at most a pixel apart. No colour is guessed from
/// another, linear gradients are kept exactly, small footprints become plain interpolation, and since all
/// weights are known and not negative, the variance is exact for independent pixels and a saturated sample
/// makes a lower bound. Without a mosaic all three channels are the one value. Neighbouring texels share
/// samples where they are smaller than the lattice: their errors are correlated then.
[[nodiscard]] RectifiedRows rectify(const RadianceImage& image, const geometry::CameraIntrinsics& camera,
                                    geometry::BayerPattern pattern,
                                    const geometry::RigidTransform& camera_from_sample,
                                    const geometry::SampleGrid& grid, int first_row, int rows);

}  // namespace rig::calibration
