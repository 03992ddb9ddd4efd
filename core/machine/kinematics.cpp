#include "core/machine/kinematics.h"

#include "core/geometry/camera.h"

namespace rig::machine {

using geometry::RigidTransform;
using geometry::Vec3;

namespace {

double at(const JointAngles& angles, AxisId axis) {
  return angles[static_cast<std::size_t>(axis)];
}

}  // namespace

RigidTransform bench_from_sample(const CarrierConfig& carrier, const JointAngles& angles) {
  const geometry::Mat3 rotation = geometry::rotation_y(at(angles, AxisId::pan)) *
                                  geometry::rotation_x(at(angles, AxisId::tilt)) *
                                  geometry::rotation_z(at(angles, AxisId::roll));
  return {rotation, rotation * Vec3{0, 0, carrier.plane_offset_m}};
}

Vec3 light_in_bench(const LightConfig& light, const JointAngles& angles) {
  const double arm = at(angles, AxisId::arm);
  return light.arm_radius_m * Vec3{std::sin(arm), 0, std::cos(arm)};
}

Vec3 camera_in_bench(const CameraConfig& camera) {
  return geometry::inverse(camera.camera_from_bench).translation;
}

DirectionPair directions_at_centre(const RigConfig& rig, const JointAngles& angles) {
  const RigidTransform sample_from_bench = geometry::inverse(bench_from_sample(rig.carrier, angles));
  return {geometry::normalized(sample_from_bench.point(light_in_bench(rig.light, angles))),
          geometry::normalized(sample_from_bench.point(camera_in_bench(rig.camera)))};
}

std::optional<std::vector<geometry::Vec2>> sample_outline(const RigConfig& rig, const JointAngles& angles) {
  return rectangle_outline(rig, angles, {0, 0}, rig.carrier.sample_width_m, rig.carrier.sample_height_m);
}

std::optional<std::vector<geometry::Vec2>> rectangle_outline(const RigConfig& rig, const JointAngles& angles,
                                                             geometry::Vec2 centre_m, double width_m,
                                                             double height_m) {
  const RigidTransform camera_from_sample =
      rig.camera.camera_from_bench * bench_from_sample(rig.carrier, angles);
  const double x = 0.5 * width_m;
  const double y = 0.5 * height_m;
  const Vec3 centre{centre_m.x, centre_m.y, 0};
  std::vector<geometry::Vec2> outline;
  for (const Vec3 offset : {Vec3{-x, -y, 0}, Vec3{x, -y, 0}, Vec3{x, y, 0}, Vec3{-x, y, 0}}) {
    const Vec3 corner = centre + offset;
    const auto pixel = geometry::project(rig.camera.intrinsics, camera_from_sample.point(corner));
    if (!pixel) return std::nullopt;
    outline.push_back(*pixel);
  }
  return outline;
}

}  // namespace rig::machine
