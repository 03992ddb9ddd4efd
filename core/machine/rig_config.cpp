#include "core/machine/rig_config.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/base/units.h"
#include "core/machine/kinematics.h"
#include "core/machine/limits.h"

namespace rig::machine {

using base::ConfigTable;
using base::radians;
using base::Range;

namespace {

constexpr int kRigFormat = 1;
constexpr std::int64_t kAnyFormat = std::numeric_limits<std::int64_t>::max();
constexpr int kLastTag = 586;        // of tag36h11
constexpr double kFullTurns = 3600;  // degrees that an axis may span at most either way

DeviceRef read_device(const ConfigTable& table, const std::vector<ModuleConfig>& modules) {
  DeviceRef device{table.text("module"), table.text("device")};
  const auto known = [&device](const ModuleConfig& m) { return m.name == device.module; };
  if (!device.module.empty() && std::none_of(modules.begin(), modules.end(), known)) {
    table.error("module", fmt::format("no [[module]] is named '{}'", device.module));
  }
  return device;
}

double mm(const ConfigTable& table, std::string_view key, double low, double high) {
  return base::metres_from_mm(table.number(key, {low, high}));
}

std::vector<ModuleConfig> read_modules(const ConfigTable& root) {
  std::vector<ModuleConfig> modules;
  for (const ConfigTable& table : root.tables("module")) {
    ConfigTable settings = table.table("settings");
    settings.leave_to_others();
    ModuleConfig module{table.text("name"), table.text("file"), settings};
    for (const ModuleConfig& other : modules) {
      if (other.name == module.name)
        table.error("name", fmt::format("a second module named '{}'", module.name));
    }
    modules.push_back(std::move(module));
  }
  if (modules.empty()) root.error("module", "is missing", "at least one [[module]]");
  return modules;
}

AxisConfig read_axis(const ConfigTable& table, const std::vector<ModuleConfig>& modules) {
  AxisConfig axis;
  axis.device = read_device(table, modules);
  axis.min_rad = radians(table.number("min_deg", {-kFullTurns, kFullTurns}));
  axis.max_rad = radians(table.number("max_deg", {-kFullTurns, kFullTurns}));
  const bool has_limits = table.has("min_deg") && table.has("max_deg");
  if (has_limits && !(axis.min_rad < axis.max_rad)) {
    table.error("max_deg", "must be greater than min_deg", "equal limits do not mean 'no limits'");
  }
  axis.max_velocity_rad_s = radians(table.number("max_velocity_deg_s", {1e-3, 3600}));
  axis.max_acceleration_rad_s2 = radians(table.number("max_acceleration_deg_s2", {1e-3, 36000}));
  axis.jog_velocity_rad_s = radians(table.number("jog_velocity_deg_s", {1e-3, 3600}));
  if (table.has("max_velocity_deg_s") && axis.jog_velocity_rad_s > axis.max_velocity_rad_s) {
    table.error("jog_velocity_deg_s", "must not exceed max_velocity_deg_s");
  }
  axis.tolerance_rad = radians(table.number("tolerance_deg", {1e-6, 10}));
  axis.settle_s = table.number("settle_ms", {0, 60000}) * 1e-3;
  axis.approach_rad = radians(table.number_or("approach_deg", 0, {0, 45}));
  axis.following_rad = radians(table.number_or("following_deg", 5, {1e-3, 360}));
  axis.home_rad = radians(table.number("home_deg", {-kFullTurns, kFullTurns}));
  if (has_limits && axis.min_rad < axis.max_rad && table.has("home_deg")) {
    if (axis.home_rad < axis.min_rad || axis.home_rad > axis.max_rad) {
      table.error("home_deg", "lies outside the limits of the axis");
    } else if (axis.home_rad - axis.approach_rad < axis.min_rad) {
      table.error("approach_deg", "from home_deg down it reaches below min_deg",
                  "the axis comes to rest from that far below");
    }
  }
  return axis;
}

// The camera looks from `position` at `target`; bench y is up in its image.
geometry::RigidTransform look_at(geometry::Vec3 position, geometry::Vec3 target) {
  const geometry::Vec3 z = geometry::normalized(target - position);
  const geometry::Vec3 x = geometry::normalized(geometry::cross(z, {0, 1, 0}));
  const geometry::Vec3 y = geometry::cross(z, x);
  const geometry::Mat3 rotation{{x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z}};
  return {rotation, -(rotation * position)};
}

CameraConfig read_camera(const ConfigTable& table, const std::vector<ModuleConfig>& modules) {
  CameraConfig camera;
  camera.device = read_device(table, modules);
  auto& c = camera.intrinsics;
  c.width = static_cast<int>(table.integer("width", 16, 65535));
  c.height = static_cast<int>(table.integer("height", 16, 65535));
  c.fx = table.number("fx_px", {1, 1e7});
  c.fy = table.number("fy_px", {1, 1e7});
  c.cx = table.number("cx_px", {-1e6, 1e6});
  c.cy = table.number("cy_px", {-1e6, 1e6});
  constexpr Range kDistortion{-100, 100};
  c.k1 = table.number_or("k1", 0, kDistortion);
  c.k2 = table.number_or("k2", 0, kDistortion);
  c.p1 = table.number_or("p1", 0, kDistortion);
  c.p2 = table.number_or("p2", 0, kDistortion);
  c.k3 = table.number_or("k3", 0, kDistortion);
  // A key that is missing or wrong reads as no pattern; its error is noted.
  camera.bayer = geometry::bayer_from_text(table.choice("bayer", {"none", "RGGB", "BGGR", "GRBG", "GBRG"}))
                     .value_or(geometry::BayerPattern::none);
  auto& s = camera.sensor;
  s.bits = static_cast<int>(table.integer("bits", 1, 16));
  const double full = static_cast<double>(1 << s.bits) - 1;
  s.black_dn = table.number("black_dn", {0, full});
  s.saturation_dn = table.number("saturation_dn", {1, full});
  if (table.has("saturation_dn") && s.saturation_dn <= s.black_dn)
    table.error("saturation_dn", "must be greater than black_dn");
  s.electrons_per_dn = table.number("electrons_per_dn", {1e-3, 1e6});
  s.read_noise_e = table.number("read_noise_e", {0, 1e6});
  const auto balance = table.numbers("white_balance", 3, {0.01, 100});
  std::copy(balance.begin(), balance.end(), camera.white_balance.begin());
  camera.min_exposure_s = table.number("min_exposure_us", {0.01, 1e10}) * 1e-6;
  camera.max_exposure_s = table.number("max_exposure_us", {0.01, 1e10}) * 1e-6;
  if (table.has("max_exposure_us") && camera.max_exposure_s < camera.min_exposure_s) {
    table.error("max_exposure_us", "is less than min_exposure_us");
  }
  const auto position = table.numbers("position_mm", 3, {-1e5, 1e5});
  const auto target =
      table.has("look_at_mm") ? table.numbers("look_at_mm", 3, {-1e5, 1e5}) : std::vector<double>(3, 0.0);
  const geometry::Vec3 from = 1e-3 * geometry::Vec3{position[0], position[1], position[2]};
  const geometry::Vec3 to = 1e-3 * geometry::Vec3{target[0], target[1], target[2]};
  if (geometry::length(geometry::cross(to - from, {0, 1, 0})) < 1e-6) {
    table.error("position_mm", "must not lie on the vertical through the point looked at");
  } else {
    camera.camera_from_bench = look_at(from, to);
  }
  return camera;
}

CarrierConfig read_carrier(const ConfigTable& table) {
  CarrierConfig carrier;
  carrier.plane_offset_m = mm(table, "plane_offset_mm", -1000, 1000);
  carrier.sample_width_m = mm(table, "sample_width_mm", 1, 5000);
  carrier.sample_height_m = mm(table, "sample_height_mm", 1, 5000);
  carrier.tag_family = table.choice("tag_family", {"tag36h11"});
  std::set<int> ids;
  for (const auto& row : table.rows("fiducials", 5)) {
    if (!(row[0] >= 0 && row[0] <= kLastTag) || row[0] != std::floor(row[0])) {
      table.error("fiducials", fmt::format("{} is no tag36h11 id", row[0]), fmt::format("0 to {}", kLastTag));
      continue;
    }
    const Fiducial f{static_cast<int>(row[0]), row[1] * 1e-3, row[2] * 1e-3, row[3] * 1e-3, radians(row[4])};
    if (!ids.insert(f.id).second) table.error("fiducials", fmt::format("id {} stands twice", f.id));
    if (!(f.size_m > 0)) table.error("fiducials", fmt::format("size of id {} must be positive", f.id));
    carrier.fiducials.push_back(f);
  }
  constexpr std::size_t kFewest = 4;
  if (table.has("fiducials") && carrier.fiducials.size() < kFewest) {
    table.error("fiducials",
                fmt::format("has {} usable tags, at least {} are needed", carrier.fiducials.size(), kFewest));
  }
  for (const ConfigTable& p : table.tables("patch")) {
    carrier.patches.push_back({mm(p, "x_mm", -5000, 5000), mm(p, "y_mm", -5000, 5000),
                               mm(p, "width_mm", 0.1, 5000), mm(p, "height_mm", 0.1, 5000),
                               p.number("reflectance", {0.001, 1})});
  }
  if (carrier.patches.empty()) table.error("patch", "is missing", "at least one [[carrier.patch]]");
  return carrier;
}

std::array<std::size_t, kAxisCount> read_home_order(const ConfigTable& root) {
  std::array<std::size_t, kAxisCount> order{0, 1, 2, 3};
  const auto table = root.table_if("home");
  if (!table) return order;
  const auto names = table->texts("order");
  std::set<std::size_t> seen;
  for (std::size_t i = 0; i < names.size() && i < kAxisCount; ++i) {
    const auto found = std::find(kAxisNames.begin(), kAxisNames.end(), names[i]);
    order[i] = static_cast<std::size_t>(found - kAxisNames.begin());
    seen.insert(order[i]);
  }
  if (names.size() != kAxisCount || seen.size() != kAxisCount || seen.count(kAxisCount) != 0) {
    table->error("order", "must name roll, tilt, pan and arm once each");
    return {0, 1, 2, 3};
  }
  return order;
}

std::vector<KeepOut> read_keep_out(const ConfigTable& root) {
  std::vector<KeepOut> rules;
  const std::vector<std::string> bodies{"light", "camera", "carrier"};
  std::set<std::string> names;
  for (const ConfigTable& table : root.tables("keep_out")) {
    KeepOut rule{table.text("name"), table.choice("first", bodies), table.choice("second", bodies),
                 mm(table, "clearance_mm", 0, 10000)};
    if (table.has("second") && rule.first == rule.second) {
      table.error("second", "must be another body than first");
    }
    if (!names.insert(rule.name).second)
      table.error("name", fmt::format("a second rule named '{}'", rule.name));
    rules.push_back(std::move(rule));
  }
  return rules;
}

// The keep-out rules are only as good as the bodies: the disc must hold all that stands on the carrier.
void check_carrier_radius(const CarrierConfig& carrier, const ConfigTable& bodies, double radius_m) {
  if (!bodies.has("carrier_radius_mm")) return;
  double farthest_m = 0;
  std::string farthest_part;
  const auto need = [&](double distance_m, const std::string& part) {
    if (distance_m <= farthest_m) return;
    farthest_m = distance_m;
    farthest_part = part;
  };
  need(0.5 * std::hypot(carrier.sample_width_m, carrier.sample_height_m), "the sample");
  for (const Fiducial& f : carrier.fiducials) {
    for (const double quarter : {0.25, 0.75, 1.25, 1.75}) {
      const double angle = f.turn_rad + quarter * base::kPi;
      const double half_diagonal = f.size_m * std::sqrt(0.5);
      need(std::hypot(f.x_m + half_diagonal * std::cos(angle), f.y_m + half_diagonal * std::sin(angle)),
           fmt::format("fiducial {}", f.id));
    }
  }
  for (const Patch& p : carrier.patches) {
    need(std::hypot(std::abs(p.x_m) + 0.5 * p.width_m, std::abs(p.y_m) + 0.5 * p.height_m),
         fmt::format("the patch at ({}, {}) mm", base::mm_from_metres(p.x_m), base::mm_from_metres(p.y_m)));
  }
  if (farthest_m > radius_m) {
    bodies.error("carrier_radius_mm",
                 fmt::format("does not reach around {}, whose corner is {:.1f} mm from the centre",
                             farthest_part, base::mm_from_metres(farthest_m)));
  }
}

Deadlines read_deadlines(const ConfigTable& table) {
  constexpr Range kMilliseconds{1, 600000};
  const Deadlines usual;
  const auto bound_s = [&](const char* key, double usual_s) {
    return 1e-3 * table.number_or(key, 1e3 * usual_s, kMilliseconds);
  };
  return {bound_s("axis_ms", usual.axis_s), bound_s("camera_ms", usual.camera_s),
          bound_s("frame_ms", usual.frame_s), bound_s("light_ms", usual.light_s),
          bound_s("lines_ms", usual.lines_s)};
}

// Two parts that name one device would each command what the other believes to be its own.
void check_devices_differ(const ConfigTable& root, const RigConfig& rig) {
  std::map<std::pair<std::string, std::string>, std::string> users;
  const auto use = [&](const DeviceRef& device, const std::string& part) {
    if (device.module.empty() || device.device.empty()) return;
    const auto [at, first] = users.emplace(std::pair(device.module, device.device), part);
    if (!first) {
      root.error("", fmt::format("{} and {} are both device '{}' of module '{}'", at->second, part,
                                 device.device, device.module));
    }
  };
  for (std::size_t i = 0; i < kAxisCount; ++i) use(rig.axes[i].device, fmt::format("axis.{}", kAxisNames[i]));
  use(rig.camera.device, "camera");
  use(rig.light.device, "light");
}

// Whether the rig may stand where the flat is taken, and sees its target there.
base::Result<void> check_flat(const RigConfig& rig) {
  const auto& flat = rig.unattended.reference->flat;
  if (!flat) return {};
  if (auto stands = check_standing(rig, flat->pose_rad); !stands) {
    return base::fail(base::ErrorCode::bad_input,
                      "the rig may not stand where the flat is taken: " + stands.error().what);
  }
  if (!flat->target) return {};
  const auto& camera = rig.camera.intrinsics;
  const auto outline = rectangle_outline(rig, flat->pose_rad, {flat->target->x_m, flat->target->y_m},
                                         flat->target->width_m, flat->target->height_m);
  const bool seen = outline && std::all_of(outline->begin(), outline->end(), [&camera](geometry::Vec2 p) {
                      return p.x >= 0 && p.y >= 0 && p.x <= camera.width - 1 && p.y <= camera.height - 1;
                    });
  if (seen) return {};
  return base::fail(base::ErrorCode::bad_input,
                    "[reference.flat] target_mm is not wholly inside the image at its pose", {},
                    "another pose_deg, a smaller target, or none where it fills the image");
}

base::Result<RigConfig> read_rig(const ConfigTable& root) {
  if (const auto format = root.integer("format", 1, kAnyFormat); format > kRigFormat) {
    return base::fail(base::ErrorCode::newer,
                      fmt::format("format {} is newer than this program reads ({})", format, kRigFormat),
                      root.where("format"), "use a newer rigd");
  }
  RigConfig rig;
  rig.name = root.text("name");
  rig.clock = root.choice_or("clock", "system", {"system", "discrete-event"}) == "system"
                  ? ClockKind::system
                  : ClockKind::discrete_event;
  rig.modules = read_modules(root);
  const ConfigTable axes = root.table("axis");
  for (std::size_t i = 0; i < kAxisCount; ++i)
    rig.axes[i] = read_axis(axes.table(kAxisNames[i]), rig.modules);
  rig.home_order = read_home_order(root);
  rig.camera = read_camera(root.table("camera"), rig.modules);
  const ConfigTable light = root.table("light");
  rig.light = {read_device(light, rig.modules),
               mm(light, "arm_radius_mm", 1, 1e5),
               mm(light, "aperture_mm", 0, 1000),
               light.number_or("warm_up_s", 0, {0, 86400}),
               light.number_or("cool_down_s", 0, {0, 86400}),
               light.number_or("safe_level", 0, {0, 1})};
  rig.carrier = read_carrier(root.table("carrier"));
  if (const auto lines = root.table_if("lines")) {
    rig.lines = read_lines(*lines, [&](const ConfigTable& table) { return read_device(table, rig.modules); });
  }
  if (const auto deadlines = root.table_if("deadlines")) rig.deadlines = read_deadlines(*deadlines);
  const ConfigTable bodies = root.table("bodies");
  rig.bodies = {mm(bodies, "light_radius_mm", 0, 10000), mm(bodies, "camera_radius_mm", 0, 10000),
                mm(bodies, "carrier_radius_mm", 0, 10000)};
  rig.keep_out = read_keep_out(root);
  rig.access = read_access(root);
  check_carrier_radius(rig.carrier, bodies, rig.bodies.carrier_radius_m);
  check_devices_differ(root, rig);
  rig.unattended = read_unattended(root);
  if (auto done = root.finish(); !done) return base::pass(done);
  // Only of a rig that is otherwise right can it be asked whether it may stand where homing leaves it.
  JointAngles home{};
  for (std::size_t i = 0; i < kAxisCount; ++i) home[i] = rig.axes[i].home_rad;
  if (auto stands = check_standing(rig, home); !stands) {
    return base::fail(base::ErrorCode::bad_input, "the rig may not stand at home: " + stands.error().what,
                      root.where("axis"));
  }
  if (rig.unattended.park_rad) {
    if (auto stands = check_standing(rig, *rig.unattended.park_rad); !stands) {
      return base::fail(base::ErrorCode::bad_input, "the rig may not stand parked: " + stands.error().what,
                        root.where("park"));
    }
  }
  if (rig.unattended.reference) {
    if (auto stands = check_standing(rig, rig.unattended.reference->pose_rad); !stands) {
      return base::fail(base::ErrorCode::bad_input,
                        "the rig may not stand where the reference is looked at: " + stands.error().what,
                        root.where("reference"));
    }
    if (auto seen = check_flat(rig); !seen) {
      return base::fail(base::ErrorCode::bad_input, seen.error().what, root.where("reference"),
                        seen.error().hint);
    }
  }
  return rig;
}

}  // namespace

base::Result<RigConfig> parse_rig_config(std::string_view text, const std::string& name) {
  auto root = ConfigTable::parse(text, name);
  if (!root) return base::pass(root);
  return read_rig(*root);
}

base::Result<RigConfig> load_rig_config(const std::string& path) {
  auto root = ConfigTable::parse_file(path);
  if (!root) return base::pass(root);
  return read_rig(*root);
}

}  // namespace rig::machine
