// The scale of reflectance: what the reference patches of each pose say about the light, and what all poses
// together do.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "calibration/hdr_merge.h"
#include "core/base/result.h"
#include "core/geometry/vec.h"
#include "core/machine/rig_config.h"

namespace rig::calibration {

/// Red, green, blue.
using Rgb = std::array<double, 3>;

/// The light's intensity as one patch of one pose shows it: the camera's signal (unit of the radiance image)
/// from unit BRDF at unit cosine, a metre from the light.
struct PatchReading {
  std::size_t patch = 0;  ///< index in CarrierConfig::patches
  Rgb intensity{};
  Rgb sigma{};  ///< of intensity, from the noise of the pixels alone
};

/// The pixels that measure_patch needs. Empty where none is in the image.
[[nodiscard]] PixelRect pixels_of_patch(const geometry::CameraIntrinsics& camera,
                                        const geometry::RigidTransform& camera_from_sample,
                                        const machine::Patch& patch);

/// Sum of signal over sum of expected signal, per colour, over the raw pixels inside the inner four fifths of
/// the patch. An error where the patch is not wholly in the image, too small or lit from below, or where any
/// of its pixels is saturated.
[[nodiscard]] base::Result<PatchReading> measure_patch(const RadianceImage& image,
                                                       const machine::CameraConfig& camera,
                                                       const geometry::RigidTransform& camera_from_sample,
                                                       geometry::Vec3 light_m, const machine::Patch& patch,
                                                       std::size_t index);

/// A patch or a pose that does not agree with the others.
struct Disagreement {
  std::size_t pose = 0;
  int patch = -1;       ///< -1: the pose as a whole
  double relative = 0;  ///< deviation, 0.03 = 3 % brighter
};

/// The light's intensity for every pose.
struct LightScale {
  std::vector<Rgb> intensity;       ///< a pose each
  std::vector<Rgb> relative_sigma;  ///< of it: an error that all texels of the pose share
  Rgb mean{};                       ///< over the scan
  Rgb between_poses{};              ///< relative standard deviation of the light from pose to pose
  Rgb between_patches{};            ///< relative standard deviation among the patches of a pose
  std::vector<Disagreement> disagreements;
};

/// One-way random effects on the logarithms, per colour: x_pi = mu + d_p + e_pi, d for the light and what
/// else a whole pose has in common, e for the patch. The variance of e is the scatter within poses; the
/// standard deviation of d is integrated over with a uniform prior (Gelman 2006), and the result is the
/// expectation and the variance of mu + d_p. A stable light gives nearly one scale for all poses, whose noise
/// is least; an unstable one gives each pose its own; between them the data decide. Patches that contradict
/// the median of their pose are left out first and listed, as are poses far from the mean. A pose without
/// readings has the mean. `readings` holds a list a pose; an error where no pose has any.
[[nodiscard]] base::Result<LightScale> pool_readings(const std::vector<std::vector<PatchReading>>& readings);

}  // namespace rig::calibration
