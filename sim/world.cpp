#include "sim/world.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/base/units.h"

namespace rig::sim {

using base::ConfigTable;
using base::radians;

namespace {

double mm(const ConfigTable& table, std::string_view key) {
  return 1e-3 * table.number(key, {0, 1e5});
}

AxisWorld read_axis(const ConfigTable& t) {
  AxisWorld axis;
  axis.resolution_rad = radians(t.number("resolution_deg", {1e-6, 1}));
  axis.repeatability_rad = radians(t.number("repeatability_deg", {0, 10}));
  axis.backlash_rad = radians(t.number("backlash_deg", {0, 10}));
  axis.low_rad = radians(t.number("low_deg", {-3600, 3600}));
  axis.high_rad = radians(t.number("high_deg", {-3600, 3600}));
  axis.low_switch_rad =
      t.has("low_switch_deg") ? radians(t.number("low_switch_deg", {-3600, 3600})) : axis.low_rad;
  axis.high_switch_rad =
      t.has("high_switch_deg") ? radians(t.number("high_switch_deg", {-3600, 3600})) : axis.high_rad;
  axis.max_velocity_rad_s = radians(t.number("max_velocity_deg_s", {1e-3, 3600}));
  axis.max_acceleration_rad_s2 = radians(t.number("max_acceleration_deg_s2", {1e-3, 36000}));
  axis.homing_velocity_rad_s = radians(t.number("homing_velocity_deg_s", {1e-3, 3600}));
  axis.home_rad = radians(t.number("home_deg", {-3600, 3600}));
  axis.power_on_rad = radians(t.number("power_on_deg", {-3600, 3600}));
  if (!(axis.low_rad < axis.high_rad)) t.error("high_deg", "must be greater than low_deg");
  const auto within = [&](const char* key, double angle) {
    if (angle < axis.low_rad || angle > axis.high_rad) t.error(key, "lies beyond the hard stops");
  };
  within("home_deg", axis.home_rad);
  within("power_on_deg", axis.power_on_rad);
  if (t.has("low_switch_deg")) within("low_switch_deg", axis.low_switch_rad);
  if (t.has("high_switch_deg")) within("high_switch_deg", axis.high_switch_rad);
  if (axis.low_rad < axis.high_rad && axis.low_switch_rad >= axis.high_switch_rad)
    t.error("high_switch_deg", "must be greater than low_switch_deg");
  return axis;
}

CameraWorld read_camera(const ConfigTable& t) {
  CameraWorld c;
  c.width = static_cast<int>(t.integer("width", 16, 16384));
  c.height = static_cast<int>(t.integer("height", 16, 16384));
  c.fx = t.number("fx_px", {1, 1e7});
  c.fy = t.number("fy_px", {1, 1e7});
  c.cx = t.number("cx_px", {-1e6, 1e6});
  c.cy = t.number("cy_px", {-1e6, 1e6});
  c.k1 = t.number_or("k1", 0, {-10, 10});
  c.k2 = t.number_or("k2", 0, {-10, 10});
  c.p1 = t.number_or("p1", 0, {-1, 1});
  c.p2 = t.number_or("p2", 0, {-1, 1});
  c.k3 = t.number_or("k3", 0, {-10, 10});
  c.distance_m = mm(t, "distance_mm");
  c.bits = static_cast<int>(t.integer("bits", 8, 16));
  c.black_dn = t.number("black_dn", {0, 65535});
  c.saturation_dn = t.number("saturation_dn", {1, 65535});
  c.electrons_per_dn = t.number("electrons_per_dn", {1e-3, 1e6});
  c.read_noise_e = t.number("read_noise_e", {0, 1e6});
  const auto sensitivity = t.numbers("sensitivity", 3, {1e-3, 1});
  std::copy_n(sensitivity.begin(), std::min<std::size_t>(3, sensitivity.size()), c.sensitivity.begin());
  c.white_fills_s = 1e-3 * t.number("white_fills_ms", {1e-3, 1e6});
  c.min_exposure_s = 1e-6 * t.number("min_exposure_us", {0.01, 1e9});
  c.max_exposure_s = 1e-6 * t.number("max_exposure_us", {0.01, 1e9});
  c.readout_s = 1e-3 * t.number("readout_ms", {0, 60000});
  const std::int64_t samples = t.integer_or("samples_per_pixel", 4, 1, 64);
  c.samples_per_side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(samples))));
  if (samples != c.samples_per_side * c.samples_per_side) {
    t.error("samples_per_pixel", "must be the square of a whole number", "4 and 9 are");
  }
  c.hashed = t.choice_or("render", "chart", {"chart", "hash"}) == "hash";
  if (c.saturation_dn <= c.black_dn) t.error("saturation_dn", "must be greater than black_dn");
  if (c.saturation_dn > std::ldexp(1.0, c.bits) - 1) t.error("saturation_dn", "does not fit into `bits`");
  if (c.max_exposure_s < c.min_exposure_s)
    t.error("max_exposure_us", "must not be less than min_exposure_us");
  return c;
}

LightWorld read_light(const ConfigTable& t) {
  return {mm(t, "arm_radius_mm"), mm(t, "aperture_mm"), t.number("warm_up_s", {0, 86400}),
          t.number_or("cold_share", 0.9, {0, 1}), t.boolean_or("warm_at_start", false)};
}

// Rows of numbers have no key of their own, so that a mistake names the row.
void read_carrier(const ConfigTable& t, World& world) {
  constexpr double kTagIds = 587;  // of tag36h11
  world.plane_offset_m = mm(t, "plane_offset_mm");
  world.carrier_half_m = 0.5 * mm(t, "carrier_mm");
  world.sample_half_m = 0.5 * mm(t, "sample_mm");
  if (world.sample_half_m > world.carrier_half_m) t.error("sample_mm", "is larger than the carrier");
  const auto check = [&](const char* key, std::size_t row, bool fine, const char* rule) {
    if (!fine) t.error(key, fmt::format("row {}: {}", row + 1, rule));
  };
  const auto inside = [&](double centre_mm, double extent_mm) {
    return std::abs(centre_mm) * 1e-3 + 0.5e-3 * extent_mm <= world.carrier_half_m;
  };
  const auto tags = t.rows("tags", 4);
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const auto& row = tags[i];
    check("tags", i, row[0] >= 0 && row[0] < kTagIds && row[0] == std::floor(row[0]),
          "tag36h11 has the ids 0 to 586");
    check("tags", i, row[3] > 0 && inside(row[1], row[3]) && inside(row[2], row[3]), "not on the carrier");
    world.tags.push_back({static_cast<int>(row[0]), row[1] * 1e-3, row[2] * 1e-3, row[3] * 1e-3});
  }
  const auto patches = t.rows("patches", 5);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto& row = patches[i];
    check("patches", i, row[2] > 0 && row[3] > 0 && inside(row[0], row[2]) && inside(row[1], row[3]),
          "not on the carrier");
    check("patches", i, row[4] >= 0 && row[4] <= 1, "a reflectance is from 0 to 1");
    world.patches.push_back({row[0] * 1e-3, row[1] * 1e-3, row[2] * 1e-3, row[3] * 1e-3, row[4]});
  }
}

}  // namespace

World read_world(const ConfigTable& settings) {
  World world;
  world.seed = static_cast<std::uint64_t>(settings.integer("seed", 0, std::int64_t{1} << 62));
  (void)settings.choice_or("sample", "chart", {"chart"});
  world.wire_log = settings.text_or("wire_log", "");
  const ConfigTable axes = settings.table("axis");
  for (std::size_t i = 0; i < kAxes; ++i) world.axes[i] = read_axis(axes.table(kAxisNames[i]));
  world.camera = read_camera(settings.table("camera"));
  world.light = read_light(settings.table("light"));
  read_carrier(settings.table("carrier"), world);
  if (const auto faults = settings.table_if("faults")) world.faults = read_fault_plan(*faults);
  return world;
}

std::int64_t counts_of(const AxisWorld& axis, double angle_rad) {
  return std::llround(angle_rad / axis.resolution_rad);
}

double true_angle(const World& world, std::size_t axis, std::int64_t counts, bool from_above) {
  const AxisWorld& a = world.axes[axis];
  const std::uint64_t key =
      base::derive_key(base::derive_key(world.seed, 1000 + axis), static_cast<std::uint64_t>(counts));
  const double error = a.repeatability_rad * (base::unit_from_bits(key) - 0.5);
  return static_cast<double>(counts) * a.resolution_rad + error + (from_above ? a.backlash_rad : 0.0);
}

double warmth(const LightWorld& light, double lit_s) {
  if (lit_s >= light.warm_up_s) return 1;
  const double left = 1 - std::max(0.0, lit_s) / light.warm_up_s;
  return 1 - (1 - light.cold_share) * left * left;
}

Frame sample_frame(const World& world, const Angles& angles) {
  // Pan turns everything about the vertical, tilt about the panned horizontal, roll about the sample's
  // normal.
  const V3 up{0, 1, 0};
  const V3 tilt_axis = turned({1, 0, 0}, up, angles[2]);
  const auto place = [&](V3 v) { return turned(turned(v, up, angles[2]), tilt_axis, angles[1]); };
  Frame frame;
  frame.z = place({0, 0, 1});
  frame.x = turned(place({1, 0, 0}), frame.z, angles[0]);
  frame.y = cross(frame.z, frame.x);
  frame.origin = world.plane_offset_m * frame.z;
  return frame;
}

V3 light_position(const World& world, const Angles& angles) {
  return world.light.arm_radius_m * turned({0, 0, 1}, {0, 1, 0}, angles[3]);
}

V3 camera_position(const World& world) {
  return {0, 0, world.camera.distance_m};
}

V3 bench_direction(V3 d) {
  return {d.x, -d.y, -d.z};
}

std::optional<V3> pixel_ray(const CameraWorld& c, double px, double py) {
  const double u = (px - c.cx) / c.fx;
  const double v = (py - c.cy) / c.fy;
  // Fixed-point iteration: the distortion of a lens is a small correction.
  double x = u;
  double y = v;
  for (int i = 0; i < 60; ++i) {
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
    if (radial <= 0) return std::nullopt;
    const double nx = (u - 2 * c.p1 * x * y - c.p2 * (r2 + 2 * x * x)) / radial;
    const double ny = (v - c.p1 * (r2 + 2 * y * y) - 2 * c.p2 * x * y) / radial;
    const double change = std::abs(nx - x) + std::abs(ny - y);
    x = nx;
    y = ny;
    if (change < 1e-13) return V3{x, y, 1};
  }
  return std::nullopt;
}

}  // namespace rig::sim
