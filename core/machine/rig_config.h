// rig.toml: the machine as its owner describes it (docs/rig-toml.md is the reference of its keys).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "core/base/result.h"
#include "core/geometry/camera.h"
#include "core/geometry/sensor.h"
#include "core/machine/access_config.h"
#include "core/machine/lines_config.h"
#include "core/machine/pose.h"
#include "core/machine/unattended_config.h"

namespace rig::machine {

struct AxisConfig {
  DeviceRef device;
  double min_rad = 0, max_rad = 0;  ///< travel limits; min < max
  double max_velocity_rad_s = 0;
  double max_acceleration_rad_s2 = 0;
  double jog_velocity_rad_s = 0;  ///< reduced speed: of jogs before homing, and the most of homing
  double tolerance_rad = 0;       ///< |readback - target| at arrival
  double settle_s = 0;
  double approach_rad = 0;   ///< length of the final approach from below; 0: approach from anywhere
  double home_rad = 0;       ///< where homing ends
  double following_rad = 0;  ///< how far a moving axis may be off its predicted way
};

/// A keep-out rule between two bodies of the rig, by nominal geometry: the straight-line clearance between
/// the light head, the camera body and the sample carrier.
struct KeepOut {
  std::string name;
  std::string first, second;  ///< "light", "camera", "carrier"
  double clearance_m = 0;
};

/// Bodies as bounding spheres (light head, camera) and a disc (carrier), for the keep-out rules.
struct Bodies {
  double light_radius_m = 0;
  double camera_radius_m = 0;
  double carrier_radius_m = 0;
};

struct Fiducial {
  int id = 0;
  double x_m = 0, y_m = 0;  ///< centre, sample frame
  double size_m = 0;        ///< edge of the black border square
  double turn_rad = 0;      ///< rotation about z; 0: the tag's top is towards +y
};

struct Patch {
  double x_m = 0, y_m = 0;  ///< centre, sample frame
  double width_m = 0, height_m = 0;
  double reflectance = 0;  ///< albedo of a diffuse reference, BRDF = reflectance / pi
};

/// The carrier: its frame is the sample frame, origin at the centre of the sample, z the outward normal.
struct CarrierConfig {
  double plane_offset_m = 0;  ///< sample plane in front of the common point of roll, tilt and pan axis
  double sample_width_m = 0, sample_height_m = 0;
  std::string tag_family;  ///< "tag36h11"
  std::vector<Fiducial> fiducials;
  std::vector<Patch> patches;  ///< reference patches; at least one
};

struct CameraConfig {
  DeviceRef device;
  geometry::CameraIntrinsics intrinsics;
  geometry::BayerPattern bayer = geometry::BayerPattern::none;
  geometry::SensorModel sensor;
  std::array<double, 3> white_balance{1, 1, 1};  ///< factors that make a neutral surface equal in R, G, B
  double min_exposure_s = 0, max_exposure_s = 0;
  geometry::RigidTransform camera_from_bench;  ///< nominal extrinsics
};

struct LightConfig {
  DeviceRef device;
  double arm_radius_m = 0;  ///< from the pan axis to the light's centre
  double aperture_m = 0;    ///< diameter of the emitting disc
  double warm_up_s = 0;
  double cool_down_s = 0;  ///< a lamp that went out is not lit again before
  double safe_level = 0;   ///< of a light without a shutter, where everything stops
};

struct ModuleConfig {
  std::string name;
  std::string file;            ///< "virtual" finds librig_driver_virtual.so in the driver path; or a path
  base::ConfigTable settings;  ///< for the module alone
};

/// How long one call of a device may take before the rig is stopped.
struct Deadlines {
  double axis_s = 1, camera_s = 2, frame_s = 30, light_s = 2, lines_s = 1;
};

/// How rigd keeps time: the wall, or discrete events for a rig that is virtual in every part.
enum class ClockKind { system, discrete_event };

struct RigConfig {
  std::string name;
  ClockKind clock = ClockKind::system;
  std::vector<ModuleConfig> modules;
  std::array<AxisConfig, kAxisCount> axes;
  std::array<std::size_t, kAxisCount> home_order{0, 1, 2, 3};
  CameraConfig camera;
  LightConfig light;
  CarrierConfig carrier;
  LinesConfig lines;
  Deadlines deadlines;
  Bodies bodies;
  std::vector<KeepOut> keep_out;
  UnattendedConfig unattended;
  AccessConfig access;
};

/// Reads and validates a whole file; every mistake in one Error, a line each with file, line, column and key.
[[nodiscard]] base::Result<RigConfig> load_rig_config(const std::string& path);
/// The same from text, for the copy that a scan keeps; `name` stands for the file in messages.
[[nodiscard]] base::Result<RigConfig> parse_rig_config(std::string_view text, const std::string& name);

}  // namespace rig::machine
