// What the simulated world truly is: read from [module.settings], known to nobody outside this folder.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "sim/fault_plan.h"
#include "sim/vector.h"

namespace rig::sim {

/// Order of the axes: roll, tilt, pan, arm.
inline constexpr std::size_t kAxes = 4;
inline constexpr std::array<const char*, kAxes> kAxisNames{"roll", "tilt", "pan", "arm"};
using Angles = std::array<double, kAxes>;

struct AxisWorld {
  double resolution_rad = 0;
  double repeatability_rad = 0;      ///< full width of the error that the readback does not see
  double backlash_rad = 0;           ///< added where the axis arrived from above
  double low_rad = 0, high_rad = 0;  ///< hard stops
  /// Where switches begin that are wired to the lines, not to the drive.
  double low_switch_rad = 0, high_switch_rad = 0;
  double max_velocity_rad_s = 0, max_acceleration_rad_s2 = 0;
  double homing_velocity_rad_s = 0;
  double home_rad = 0;
  double power_on_rad = 0;  ///< where it stands when the world is made
};

struct CameraWorld {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  double distance_m = 0;  ///< of its centre from the common point of the axes, on the z axis
  int bits = 12;
  double black_dn = 0, saturation_dn = 0, electrons_per_dn = 1, read_noise_e = 0;
  std::array<double, 3> sensitivity{1, 1, 1};
  double white_fills_s = 0;  ///< exposure in which a perfect diffuser facing the light saturates green
  int samples_per_side = 2;  ///< a pixel's radiance is the mean of this squared
  double min_exposure_s = 0, max_exposure_s = 0, readout_s = 0;
  bool hashed = false;  ///< frames are painted from a hash, not rendered
};

struct LightWorld {
  double arm_radius_m = 0;
  double aperture_m = 0;       ///< diameter
  double warm_up_s = 0;        ///< until the lamp gives all of its level
  double cold_share = 1;       ///< of its level that a lamp gives when it is switched on
  bool warm_at_start = false;  ///< a new world begins with the lamp on and warm
};

struct TagWorld {
  int id;
  double x_m, y_m, size_m;
};

struct PatchWorld {
  double x_m, y_m, width_m, height_m, reflectance;
};

struct World {
  std::uint64_t seed = 0;
  std::array<AxisWorld, kAxes> axes;
  CameraWorld camera;
  LightWorld light;
  double plane_offset_m = 0, carrier_half_m = 0, sample_half_m = 0;
  std::vector<TagWorld> tags;
  std::vector<PatchWorld> patches;
  FaultPlan faults;
  std::string wire_log;  ///< file for the times of stops; empty: none
};

/// Reads the settings (docs/virtual-rig.md); mistakes are noted in the table.
[[nodiscard]] World read_world(const base::ConfigTable& settings);

/// Motor counts of an angle.
[[nodiscard]] std::int64_t counts_of(const AxisWorld& axis, double angle_rad);

/// Where the axis truly stands when its readback says `counts`: the count's angle, the error of this count (a
/// function of seed, axis and count alone), and the backlash where it came from above.
[[nodiscard]] double true_angle(const World& world, std::size_t axis, std::int64_t counts, bool from_above);

/// What a lamp gives of its level after being lit for some time: from cold_share smoothly to exactly 1.
[[nodiscard]] double warmth(const LightWorld& light, double lit_s);

/// The sample's frame and the light's centre in the bench, for true angles.
[[nodiscard]] Frame sample_frame(const World& world, const Angles& angles);
[[nodiscard]] V3 light_position(const World& world, const Angles& angles);
[[nodiscard]] V3 camera_position(const World& world);

/// A direction of the camera (x right, y down, z forward) in the bench.
[[nodiscard]] V3 bench_direction(V3 camera_direction);

/// Undistorted ray direction (z = 1) of a pixel position in the camera frame; nothing where distortion folds.
[[nodiscard]] std::optional<V3> pixel_ray(const CameraWorld& camera, double px, double py);

}  // namespace rig::sim
