#include "sim/renderer.h"

#include <algorithm>
#include <apriltag/apriltag.h>
#include <apriltag/common/image_u8.h>
#include <apriltag/tag36h11.h>

#include "core/base/parallel.h"
#include "core/base/random.h"
#include "sim/chart.h"

namespace rig::sim {

namespace {

constexpr int kSide = 2;  // samples a pixel: kSide x kSide
constexpr int kSamples = kSide * kSide;
constexpr double kWhite = 0.78;  // albedos of the printed carrier
constexpr double kBlack = 0.035;
constexpr double kBoard = 0.06;
constexpr int kTagCells = 10;  // 8 with the black border, and one white cell around

// A tag as the library prints it: row 0 is its top; 1 is white.
struct TagImage {
  std::array<std::array<bool, kTagCells>, kTagCells> white{};
};

std::vector<TagImage> print_tags(const World& world) {
  apriltag_family_t* family = tag36h11_create();
  std::vector<TagImage> images;
  for (const TagWorld& tag : world.tags) {
    TagImage image;
    if (tag.id >= 0 && static_cast<std::uint32_t>(tag.id) < family->ncodes) {
      image_u8_t* printed = apriltag_to_image(family, static_cast<std::uint32_t>(tag.id));
      for (int y = 0; y < kTagCells; ++y) {
        for (int x = 0; x < kTagCells; ++x) {
          image.white[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] =
              printed->buf[y * printed->stride + x] > 127;
        }
      }
      image_u8_destroy(printed);
    }
    images.push_back(image);
  }
  tag36h11_destroy(family);
  return images;
}

int channel_of(int x, int y) {
  return (y & 1) == 0 ? ((x & 1) == 0 ? 0 : 1) : ((x & 1) == 0 ? 1 : 2);
}

}  // namespace

struct Renderer::State {
  World world;
  std::vector<TagImage> tags;
  std::vector<std::array<float, 2>> rays;  // kSamples a pixel: the undistorted direction (x, y, 1)

  explicit State(const World& w) : world(w), tags(print_tags(w)) {
    const CameraWorld& c = world.camera;
    rays.resize(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height) * kSamples);
    base::parallel_for(static_cast<std::size_t>(c.height), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        for (int x = 0; x < c.width; ++x) {
          for (int s = 0; s < kSamples; ++s) {
            const double dx = (s % kSide + 0.5) / kSide - 0.5;
            const double dy = (s / kSide + 0.5) / kSide - 0.5;
            const auto ray = pixel_ray(c, x + dx, static_cast<double>(y) + dy);
            auto& out =
                rays[(y * static_cast<std::size_t>(c.width) + static_cast<std::size_t>(x)) * kSamples +
                     static_cast<std::size_t>(s)];
            // Where the lens folds nothing is seen: a ray that misses everything.
            out = ray ? std::array<float, 2>{static_cast<float>(ray->x), static_cast<float>(ray->y)}
                      : std::array<float, 2>{1e6F, 1e6F};
          }
        }
      }
    });
  }

  // Albedo of the printed carrier outside the sample; negative off the carrier.
  [[nodiscard]] double print_at(double x, double y) const {
    if (std::abs(x) > world.carrier_half_m || std::abs(y) > world.carrier_half_m) return -1;
    for (const PatchWorld& p : world.patches) {
      if (std::abs(x - p.x_m) <= 0.5 * p.width_m && std::abs(y - p.y_m) <= 0.5 * p.height_m)
        return p.reflectance;
    }
    for (std::size_t i = 0; i < tags.size(); ++i) {
      const TagWorld& t = world.tags[i];
      const double cell = t.size_m / 8;
      const double u = (x - t.x_m) / cell + 0.5 * kTagCells;
      const double v = (t.y_m - y) / cell + 0.5 * kTagCells;
      if (u < 0 || v < 0 || u >= kTagCells || v >= kTagCells) continue;
      return tags[i].white[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] ? kWhite : kBlack;
    }
    return kBoard;
  }

  [[nodiscard]] double brdf(V3 point, V3 wi, V3 wr, int channel) const {
    if (std::abs(point.x) <= world.sample_half_m && std::abs(point.y) <= world.sample_half_m) {
      return spot_brdf(spot_at(1e3 * point.x, 1e3 * point.y), wi, wr, channel);
    }
    const double albedo = print_at(point.x, point.y);
    return albedo < 0 ? 0 : albedo / kPi;
  }
};

Renderer::Renderer(const World& world) : state_(std::make_unique<State>(world)) {}
Renderer::~Renderer() = default;

std::vector<float> Renderer::render(const Angles& angles, double level) const {
  const World& world = state_->world;
  const CameraWorld& c = world.camera;
  const Frame frame = sample_frame(world, angles);
  const V3 camera = frame.in(camera_position(world));
  const V3 light = light_position(world, angles);
  const V3 towards = unit(-1.0 * light);
  const V3 across = unit(cross({0, 1, 0}, towards));
  const V3 along = cross(towards, across);
  const double radius = 0.5 * world.light.aperture_m;
  const double full_well = (c.saturation_dn - c.black_dn) * c.electrons_per_dn;
  // A perfect diffuser (1/pi) facing the light at the arm's radius fills the sensor in white_fills_s.
  const double r0 = world.light.arm_radius_m;
  const double rate = level * full_well / c.white_fills_s * kPi * r0 * r0;
  std::vector<float> image(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height));
  base::parallel_for(static_cast<std::size_t>(c.height), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (int x = 0; x < c.width; ++x) {
        const std::size_t pixel = y * static_cast<std::size_t>(c.width) + static_cast<std::size_t>(x);
        const int channel = channel_of(x, static_cast<int>(y));
        // The four samples take four quarters of the aperture, in an order that differs from pixel to pixel.
        const std::uint64_t shuffle = base::mix64(pixel);
        double sum = 0;
        for (std::size_t s = 0; s < kSamples; ++s) {
          const auto& ray = state_->rays[pixel * kSamples + s];
          const V3 bench = bench_direction({ray[0], ray[1], 1});
          const V3 direction{dot(bench, frame.x), dot(bench, frame.y), dot(bench, frame.z)};
          if (direction.z >= 0 || camera.z <= 0) continue;  // sees the back of the carrier, or past it
          const V3 point = camera + (-camera.z / direction.z) * direction;
          if (std::abs(point.x) > world.carrier_half_m || std::abs(point.y) > world.carrier_half_m) continue;
          const double turn = 0.5 * kPi * static_cast<double>((s + shuffle) & 3) + 0.25 * kPi;
          const double out = radius * 0.70710678;
          const V3 source = frame.in(light + out * (std::cos(turn) * across + std::sin(turn) * along));
          const V3 to_light = source - point;
          if (to_light.z <= 0) continue;
          const double r2 = dot(to_light, to_light);
          const V3 wi = (1 / std::sqrt(r2)) * to_light;
          const V3 wr = unit(camera - point);
          sum += state_->brdf(point, wi, wr, channel) * wi.z / r2;
        }
        image[pixel] =
            static_cast<float>(rate * c.sensitivity[static_cast<std::size_t>(channel)] * sum / kSamples);
      }
    }
  });
  return image;
}

}  // namespace rig::sim
