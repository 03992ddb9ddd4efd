// A small rig and a small renderer of what its camera sees, for tests: a Lambertian carrier with tags,
// patches and a sample of any albedo, lit by a point. It shares core/geometry with the code under test and
// nothing else.
#pragma once

#include <algorithm>
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/base/units.h"
#include "core/geometry/camera.h"
#include "core/geometry/sensor.h"
#include "core/geometry/vec.h"
#include "core/machine/rig_config.h"

namespace rig::testing {

using Rgb = std::array<double, 3>;
/// Albedo of the sample at a point of its plane, metres.
using Texture = std::function<Rgb(double x_m, double y_m)>;

inline constexpr double kWhiteAlbedo = 0.8;
inline constexpr double kBlackAlbedo = 0.04;
inline constexpr double kCarrierAlbedo = 0.3;

/// 640 x 480 pixels at 0.2 mm, a sample of 40 mm, twelve tags of 12 mm, four patches.
inline machine::RigConfig small_rig() {
  machine::RigConfig rig;
  rig.name = "small";
  geometry::CameraIntrinsics& camera = rig.camera.intrinsics;
  camera = {640, 480, 6000, 6000, 321.3, 237.8, -0.12, 0.05, 0.0004, -0.0003, 0};
  rig.camera.bayer = geometry::BayerPattern::rggb;
  rig.camera.sensor = {12, 64, 4095, 8, 6};
  rig.camera.white_balance = {1.6, 1.0, 1.4};
  rig.camera.min_exposure_s = 1e-5;
  rig.camera.max_exposure_s = 10;
  rig.camera.camera_from_bench = {{{1, 0, 0, 0, -1, 0, 0, 0, -1}}, {0, 0, 1.2254}};
  rig.light.arm_radius_m = 1.0;
  rig.light.aperture_m = 0.02;
  rig.carrier.plane_offset_m = 0.0254;
  rig.carrier.sample_width_m = rig.carrier.sample_height_m = 0.040;
  rig.carrier.tag_family = "tag36h11";
  int id = 3;
  for (const double y : {-0.034, 0.034}) {
    for (const double x : {-0.045, -0.015, 0.015, 0.045})
      rig.carrier.fiducials.push_back({id++, x, y, 0.012, 0});
  }
  for (const double y : {-0.012, 0.012}) {
    for (const double x : {-0.045, 0.045}) rig.carrier.fiducials.push_back({id++, x, y, 0.012, 0});
  }
  for (const auto& [x, y] : {std::pair{0.0, 0.034}, {0.0, -0.034}, {0.030, 0.0}, {-0.030, 0.0}}) {
    rig.carrier.patches.push_back({x, y, 0.010, 0.010, 0.5});
  }
  return rig;
}

/// The pixels of tags as libapriltag draws them upright: row 0 on top, white margin included, true is white.
class TagArt {
 public:
  TagArt() : family_(tag36h11_create()) {}
  TagArt(const TagArt&) = delete;
  TagArt& operator=(const TagArt&) = delete;
  ~TagArt() { tag36h11_destroy(family_); }

  static constexpr int kCells = 10;  ///< across, margin included
  void load(int id) {
    image_u8_t* image = apriltag_to_image(family_, id);
    std::vector<bool>& cells = tags_[id];
    cells.resize(kCells * kCells);
    for (int y = 0; y < kCells; ++y) {
      for (int x = 0; x < kCells; ++x) {
        cells[static_cast<std::size_t>(y * kCells + x)] = image->buf[y * image->stride + x] > 127;
      }
    }
    // image_u8_destroy is in a library of its own.
    std::free(image->buf);
    std::free(image);
  }
  [[nodiscard]] bool white(int id, int column, int row_from_top) const {
    return tags_.at(id)[static_cast<std::size_t>(row_from_top * kCells + column)];
  }

 private:
  apriltag_family_t* family_;
  std::map<int, std::vector<bool>> tags_;
};

/// What stands where on the carrier.
class Carrier {
 public:
  Carrier(const machine::RigConfig& rig, Texture texture) : rig_(rig.carrier), texture_(std::move(texture)) {
    for (const auto& fiducial : rig_.fiducials) art_.load(fiducial.id);
  }

  [[nodiscard]] Rgb albedo(double x, double y) const {
    if (std::abs(x) <= rig_.sample_width_m / 2 && std::abs(y) <= rig_.sample_height_m / 2)
      return texture_(x, y);
    for (const auto& patch : rig_.patches) {
      if (std::abs(x - patch.x_m) <= patch.width_m / 2 && std::abs(y - patch.y_m) <= patch.height_m / 2) {
        return {patch.reflectance, patch.reflectance, patch.reflectance};
      }
    }
    for (const auto& tag : rig_.fiducials) {
      const double c = std::cos(tag.turn_rad), s = std::sin(tag.turn_rad);
      const double dx = x - tag.x_m, dy = y - tag.y_m;
      const double cell = tag.size_m / 8;
      const int column = static_cast<int>(std::floor((c * dx + s * dy) / cell + TagArt::kCells / 2.0));
      const int row = static_cast<int>(std::floor((s * dx - c * dy) / cell + TagArt::kCells / 2.0));
      if (column < 0 || row < 0 || column >= TagArt::kCells || row >= TagArt::kCells) continue;
      const double a = art_.white(tag.id, column, row) ? kWhiteAlbedo : kBlackAlbedo;
      return {a, a, a};
    }
    return {kCarrierAlbedo, kCarrierAlbedo, kCarrierAlbedo};
  }

 private:
  machine::CarrierConfig rig_;
  Texture texture_;
  TagArt art_;
};

/// Mean signal of every sample of the mosaic, DN per second above black: `samples` x `samples` jittered rays
/// a pixel. `light_m` in the sample frame; `intensity` is the camera's response (DN per second) to unit BRDF
/// and unit cosine a metre from the light.
inline std::vector<double> render(const machine::RigConfig& rig, const Carrier& carrier,
                                  const geometry::RigidTransform& camera_from_sample, geometry::Vec3 light_m,
                                  const Rgb& intensity, int samples = 4) {
  const geometry::CameraIntrinsics& camera = rig.camera.intrinsics;
  std::vector<double> out(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  base::parallel_for(static_cast<std::size_t>(camera.height), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t index = y * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x);
        base::Random random(base::derive_key(77, index));
        const auto colour =
            static_cast<std::size_t>(geometry::colour_at(rig.camera.bayer, x, static_cast<int>(y)));
        double sum = 0;
        for (int i = 0; i < samples * samples; ++i) {
          const geometry::Vec2 pixel{
              x - 0.5 + (i % samples + random.uniform()) / samples,
              static_cast<double>(y) - 0.5 + (i / samples + random.uniform()) / samples};
          const auto point = geometry::intersect_plane(camera, camera_from_sample, pixel);
          if (!point) continue;
          const geometry::Vec3 to_light = light_m - *point;
          const double r2 = dot(to_light, to_light);
          const double cosine = to_light.z / std::sqrt(r2);
          if (cosine <= 0) continue;
          sum += carrier.albedo(point->x, point->y)[colour] / base::kPi * intensity[colour] * cosine / r2;
        }
        out[index] = sum / (samples * samples);
      }
    }
  });
  return out;
}

/// One exposure of a rendered signal: photon and read noise, black level, quantised, clipped.
inline std::vector<std::uint16_t> expose(const machine::RigConfig& rig, const std::vector<double>& signal,
                                         double exposure_s, std::uint64_t seed) {
  const geometry::SensorModel& sensor = rig.camera.sensor;
  std::vector<std::uint16_t> out(signal.size());
  base::parallel_for(signal.size(), 10000, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      base::Random random(base::derive_key(seed, i));
      const double mean = signal[i] * exposure_s;
      const double read = sensor.read_noise_e / sensor.electrons_per_dn;
      const double sigma = std::sqrt(mean / sensor.electrons_per_dn + read * read);
      const double dn = std::round(sensor.black_dn + mean + sigma * random.normal());
      out[i] = static_cast<std::uint16_t>(std::clamp(dn, 0.0, sensor.saturation_dn));
    }
  });
  return out;
}

/// camera_from_sample of the small rig's kind: the sample turned by roll, then tilted about x, then panned
/// about y, its centre before the camera at 1.2 m with a shift.
inline geometry::RigidTransform pose(double roll_deg, double tilt_deg, double pan_deg,
                                     geometry::Vec3 shift_m = {}) {
  const geometry::Mat3 facing{{1, 0, 0, 0, -1, 0, 0, 0, -1}};
  return {facing * geometry::rotation_y(base::radians(pan_deg)) *
              geometry::rotation_x(base::radians(tilt_deg)) * geometry::rotation_z(base::radians(roll_deg)),
          geometry::Vec3{0, 0, 1.2} + shift_m};
}

}  // namespace rig::testing
