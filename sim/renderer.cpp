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

// Points of a disc of radius 1 whose mean is its centre and whose second moments are the disc's own, so that
// a few of them stand for it where reflectance changes slowly over it: one ring, or two of equal area.
std::vector<std::array<double, 2>> disc_points(std::size_t n, double turn_rad) {
  const std::size_t inner = n > 8 ? n / 3 : 0;
  const double share = static_cast<double>(inner) / static_cast<double>(n);
  std::vector<std::array<double, 2>> points;
  for (std::size_t i = 0; i < n; ++i) {
    const bool outer = i >= inner;
    const double radius = std::sqrt(0.5 * (outer ? 1 + share : share));
    const double step = 2 * kPi / static_cast<double>(outer ? n - inner : inner);
    const double angle = turn_rad + step * static_cast<double>(i);
    points.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return points;
}

constexpr std::size_t kTurns = 16;  // of the disc's points; a pixel's place in the image chooses one

}  // namespace

struct Renderer::State {
  World world;
  std::vector<TagImage> tags;
  std::size_t samples;                     // a pixel
  std::vector<std::array<float, 2>> rays;  // of every sample: the undistorted direction (x, y, 1)

  explicit State(const World& w)
      : world(w),
        tags(print_tags(w)),
        samples(static_cast<std::size_t>(w.camera.samples_per_side * w.camera.samples_per_side)) {
    const CameraWorld& c = world.camera;
    const auto width = static_cast<std::size_t>(c.width);
    const int side = c.samples_per_side;
    rays.resize(width * static_cast<std::size_t>(c.height) * samples);
    base::parallel_for(static_cast<std::size_t>(c.height), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin * width * samples; i < end * width * samples; ++i) {
        const std::size_t pixel = i / samples;
        const auto s = static_cast<int>(i % samples);
        const double x = static_cast<double>(pixel % width) + (s % side + 0.5) / side - 0.5;
        const double y = static_cast<double>(pixel / width) + (s / side + 0.5) / side - 0.5;
        const auto ray = pixel_ray(c, x, y);
        // Where the lens folds nothing is seen: a ray that misses everything.
        rays[i] = ray ? std::array<float, 2>{static_cast<float>(ray->x), static_cast<float>(ray->y)}
                      : std::array<float, 2>{1e6F, 1e6F};
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

std::vector<float> Renderer::render(const Angles& angles) const {
  const World& world = state_->world;
  const CameraWorld& c = world.camera;
  const std::size_t samples = state_->samples;
  const auto width = static_cast<std::size_t>(c.width);
  std::vector<float> image(width * static_cast<std::size_t>(c.height));

  // Everything in the frame of the sample.
  const Frame frame = sample_frame(world, angles);
  const V3 camera = frame.in(camera_position(world));
  if (camera.z <= 0) return image;  // the back of the carrier is black
  const auto inside = [&frame](V3 bench) {
    return V3{dot(bench, frame.x), dot(bench, frame.y), dot(bench, frame.z)};
  };
  const V3 right = inside(bench_direction({1, 0, 0}));
  const V3 down = inside(bench_direction({0, 1, 0}));
  const V3 ahead = inside(bench_direction({0, 0, 1}));

  // The aperture is a disc that faces the common point of the axes.
  const V3 light = light_position(world, angles);
  const V3 across = unit(cross({0, 1, 0}, light));
  const V3 along = unit(cross(light, across));
  std::vector<V3> sources;
  for (std::size_t turn = 0; turn < kTurns; ++turn) {
    for (const auto& p : disc_points(samples, 2 * kPi * static_cast<double>(turn) / kTurns)) {
      const double radius = 0.5 * world.light.aperture_m;
      sources.push_back(frame.in(light + radius * (p[0] * across + p[1] * along)));
    }
  }

  // A perfect diffuser (BRDF 1/pi) facing the light at the arm's radius fills the sensor in white_fills_s.
  const double full_well = (c.saturation_dn - c.black_dn) * c.electrons_per_dn;
  const double r0 = world.light.arm_radius_m;
  const double rate = full_well / c.white_fills_s * kPi * r0 * r0 / static_cast<double>(samples);

  base::parallel_for(static_cast<std::size_t>(c.height), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
      const int channel = channel_of(static_cast<int>(pixel % width), static_cast<int>(pixel / width));
      const V3* aperture = &sources[(base::mix64(pixel) % kTurns) * samples];
      double sum = 0;
      for (std::size_t s = 0; s < samples; ++s) {
        const auto& ray = state_->rays[pixel * samples + s];
        const V3 direction = static_cast<double>(ray[0]) * right + static_cast<double>(ray[1]) * down + ahead;
        if (direction.z >= 0) continue;
        const V3 point = camera + (-camera.z / direction.z) * direction;
        if (std::abs(point.x) > world.carrier_half_m || std::abs(point.y) > world.carrier_half_m) continue;
        const V3 to_light = aperture[s] - point;
        if (to_light.z <= 0) continue;
        const double r2 = dot(to_light, to_light);
        const V3 wi = (1 / std::sqrt(r2)) * to_light;
        sum += state_->brdf(point, wi, unit(-1.0 * direction), channel) * wi.z / r2;
      }
      image[pixel] = static_cast<float>(rate * c.sensitivity[static_cast<std::size_t>(channel)] * sum);
    }
  });
  return image;
}

}  // namespace rig::sim
