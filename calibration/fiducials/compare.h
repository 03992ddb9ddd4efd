// Whether the same tags stand in two images where they stood: did the sample, the carrier or the camera move?
#pragma once

#include <string>
#include <vector>

#include "calibration/fiducials/tag_finder.h"
#include "core/geometry/vec.h"

namespace rig::calibration {

struct FiducialShift {
  int before = 0;           ///< tags seen in the first image
  int common = 0;           ///< of those, seen in the second too
  geometry::Vec2 shift_px;  ///< median of the tags' centres, second minus first
  double turn_rad = 0;      ///< median of the lines between centres; from x towards y
};

/// What moved between two images of the same pose and rig. Medians: one tag that was misread or pushed does
/// not move the others. An id that is in an image twice is left out.
[[nodiscard]] FiducialShift compare_fiducials(const std::vector<TagSighting>& before,
                                              const std::vector<TagSighting>& after);

struct ShiftTolerance {
  double shift_px = 2;
  double turn_rad = 0.003;
};

/// Fewest tags for a judgement.
inline constexpr std::size_t kFewestCompared = 3;

/// Empty where nothing moved by more than the tolerance, else what did, in words: also where less than half
/// of the tags are seen again. Only for a first image with at least kFewestCompared tags.
[[nodiscard]] std::string what_moved(const FiducialShift& shift, const ShiftTolerance& tolerance);

}  // namespace rig::calibration
