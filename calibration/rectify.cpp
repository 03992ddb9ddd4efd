#include "calibration/rectify.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/projection.h"
#include "core/base/parallel.h"

namespace rig::calibration {

namespace {

using geometry::Vec2;
using geometry::Vec3;

constexpr int kMostSteps = 64;  // across a footprint: beyond that texels are larger than any use
constexpr int kReach = 2;       // of a lattice's interpolation, pixels
constexpr std::size_t kGrainRows = 8;

// Where the samples of one colour are.
enum class LatticeKind { every, second, quincunx };
struct Lattice {
  LatticeKind kind = LatticeKind::every;
  int x = 0, y = 0;  // an origin

  // Calls add(x, y, weight) for the up to four samples around a place.
  template <typename Add>
  void interpolate(Vec2 at, Add&& add) const {
    const double dx = at.x - x, dy = at.y - y;
    double u = dx, v = dy;
    if (kind == LatticeKind::second) u = 0.5 * dx, v = 0.5 * dy;
    if (kind == LatticeKind::quincunx) u = 0.5 * (dx + dy), v = 0.5 * (dx - dy);
    const double u0 = std::floor(u), v0 = std::floor(v);
    const double fu = u - u0, fv = v - v0;
    const int iu = static_cast<int>(u0), iv = static_cast<int>(v0);
    const auto put = [&](int a, int b, double weight) {
      if (kind == LatticeKind::every) add(x + a, y + b, weight);
      if (kind == LatticeKind::second) add(x + 2 * a, y + 2 * b, weight);
      if (kind == LatticeKind::quincunx) add(x + a + b, y + a - b, weight);
    };
    put(iu, iv, (1 - fu) * (1 - fv));
    put(iu + 1, iv, fu * (1 - fv));
    put(iu, iv + 1, (1 - fu) * fv);
    put(iu + 1, iv + 1, fu * fv);
  }
};

std::vector<Lattice> lattices(geometry::BayerPattern pattern) {
  if (pattern == geometry::BayerPattern::none) return {Lattice{}};
  std::vector<Lattice> out(3);
  for (int y = 1; y >= 0; --y) {
    for (int x = 1; x >= 0; --x) {
      const auto colour = geometry::colour_at(pattern, x, y);
      const auto kind = colour == geometry::Colour::green ? LatticeKind::quincunx : LatticeKind::second;
      out[static_cast<std::size_t>(colour)] = {kind, x, y};
    }
  }
  return out;
}

// Weights of the samples around one texel.
struct Window {
  PixelRect rect;
  std::vector<float> weight;

  void reset(const PixelRect& at) {
    rect = at;
    weight.assign(static_cast<std::size_t>(at.width) * static_cast<std::size_t>(at.height), 0.0F);
  }
  void add(int x, int y, double w) {
    weight[static_cast<std::size_t>(y - rect.y) * static_cast<std::size_t>(rect.width) +
           static_cast<std::size_t>(x - rect.x)] += static_cast<float>(w);
  }
};

// A texel's parallelogram: middle and the two edge vectors, pixels.
struct Footprint {
  Vec2 middle, along_s, along_t;
  int steps_s = 1, steps_t = 1;
};

int steps_for(Vec2 edge) {
  return std::clamp(static_cast<int>(std::ceil(std::hypot(edge.x, edge.y))), 1, kMostSteps);
}

PixelRect window_of(const Footprint& f) {
  const double rx = 0.5 * (std::abs(f.along_s.x) + std::abs(f.along_t.x));
  const double ry = 0.5 * (std::abs(f.along_s.y) + std::abs(f.along_t.y));
  const int x0 = static_cast<int>(std::floor(f.middle.x - rx)) - kReach;
  const int y0 = static_cast<int>(std::floor(f.middle.y - ry)) - kReach;
  const int x1 = static_cast<int>(std::ceil(f.middle.x + rx)) + kReach;
  const int y1 = static_cast<int>(std::ceil(f.middle.y + ry)) + kReach;
  return {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

// One texel: weights into the window, then sums over it.
class Gatherer {
 public:
  Gatherer(const RadianceImage& image, geometry::BayerPattern pattern)
      : image_(image), lattices_(lattices(pattern)) {
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 2; ++x) {
        colour_[static_cast<std::size_t>(2 * y + x)] =
            lattices_.size() == 1 ? 0 : static_cast<std::size_t>(geometry::colour_at(pattern, x, y));
      }
    }
  }

  TexelState gather(const Footprint& footprint, float* value, float* variance) {
    const PixelRect rect = window_of(footprint);
    if (!image_.rect.contains(rect)) return TexelState::missing;
    window_.reset(rect);
    const double share = 1.0 / (footprint.steps_s * footprint.steps_t);
    for (int j = 0; j < footprint.steps_t; ++j) {
      const double b = (j + 0.5) / footprint.steps_t - 0.5;
      for (int i = 0; i < footprint.steps_s; ++i) {
        const double a = (i + 0.5) / footprint.steps_s - 0.5;
        const Vec2 at{footprint.middle.x + a * footprint.along_s.x + b * footprint.along_t.x,
                      footprint.middle.y + a * footprint.along_s.y + b * footprint.along_t.y};
        for (const Lattice& lattice : lattices_) {
          lattice.interpolate(at, [&](int x, int y, double w) { window_.add(x, y, share * w); });
        }
      }
    }
    std::array<float, 3> sum{}, sum_variance{};
    bool saturated = false;
    std::size_t w = 0;
    for (int y = rect.y; y < rect.y + rect.height; ++y) {
      std::size_t pixel = image_.index(rect.x, y);
      for (int x = rect.x; x < rect.x + rect.width; ++x, ++pixel, ++w) {
        const float weight = window_.weight[w];
        if (weight == 0.0F) continue;
        const std::size_t colour = colour_[static_cast<std::size_t>(2 * (y & 1) + (x & 1))];
        sum[colour] += weight * image_.value[pixel];
        sum_variance[colour] += weight * weight * image_.variance[pixel];
        saturated = saturated || image_.saturated[pixel] != 0;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t from = lattices_.size() == 1 ? 0 : c;
      value[c] = sum[from];
      variance[c] = sum_variance[from];
    }
    return saturated ? TexelState::saturated : TexelState::good;
  }

 private:
  const RadianceImage& image_;
  std::vector<Lattice> lattices_;
  std::array<std::size_t, 4> colour_{};
  Window window_;
};

}  // namespace

PixelRect pixels_of_rows(const geometry::CameraIntrinsics& camera,
                         const geometry::RigidTransform& camera_from_sample, const geometry::SampleGrid& grid,
                         int first_row, int rows) {
  // The outline is enough: the inside of a convex curve stays inside its image.
  constexpr int kPoints = 64;
  double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9, texel = 0;
  const double w = grid.width_m / grid.columns, h = grid.height_m / grid.rows;
  for (int i = 0; i <= kPoints; ++i) {
    const double a = static_cast<double>(i) / kPoints;
    const double s = a * grid.columns - 0.5, t = first_row + a * rows - 0.5;
    const double top = first_row + rows - 0.5;
    for (const Vec2 at :
         {Vec2{s, first_row - 0.5}, Vec2{s, top}, Vec2{-0.5, t}, Vec2{grid.columns - 0.5, t}}) {
      const Vec3 point{((at.x + 0.5) / grid.columns - 0.5) * grid.width_m,
                       ((at.y + 0.5) / grid.rows - 0.5) * grid.height_m, 0};
      const auto seen = project_from_plane(camera, camera_from_sample, point);
      if (!seen) continue;
      x0 = std::min(x0, seen->pixel.x), x1 = std::max(x1, seen->pixel.x);
      y0 = std::min(y0, seen->pixel.y), y1 = std::max(y1, seen->pixel.y);
      texel = std::max(texel, (std::abs(seen->by_plane[0]) + std::abs(seen->by_plane[2])) * w +
                                  (std::abs(seen->by_plane[1]) + std::abs(seen->by_plane[3])) * h);
    }
  }
  const double margin = texel + kReach + 2;
  const int left =
      static_cast<int>(std::clamp(std::floor(x0 - margin), 0.0, static_cast<double>(camera.width)));
  const int top =
      static_cast<int>(std::clamp(std::floor(y0 - margin), 0.0, static_cast<double>(camera.height)));
  const int right =
      static_cast<int>(std::clamp(std::ceil(x1 + margin) + 1, 0.0, static_cast<double>(camera.width)));
  const int bottom =
      static_cast<int>(std::clamp(std::ceil(y1 + margin) + 1, 0.0, static_cast<double>(camera.height)));
  return {left, top, std::max(right - left, 0), std::max(bottom - top, 0)};
}

RectifiedRows rectify(const RadianceImage& image, const geometry::CameraIntrinsics& camera,
                      geometry::BayerPattern pattern, const geometry::RigidTransform& camera_from_sample,
                      const geometry::SampleGrid& grid, int first_row, int rows) {
  RectifiedRows out;
  out.first_row = first_row;
  out.rows = rows;
  out.columns = grid.columns;
  const std::size_t texels = static_cast<std::size_t>(rows) * static_cast<std::size_t>(grid.columns);
  out.value.resize(3 * texels);
  out.variance.resize(3 * texels);
  out.state.assign(texels, TexelState::missing);
  const Vec3 camera_in_sample = geometry::inverse(camera_from_sample).translation;
  if (camera_in_sample.z <= 0) return out;

  const double w = grid.width_m / grid.columns, h = grid.height_m / grid.rows;
  base::parallel_for(static_cast<std::size_t>(rows), kGrainRows, [&](std::size_t begin, std::size_t end) {
    Gatherer gatherer(image, pattern);
    for (std::size_t row = begin; row < end; ++row) {
      for (int s = 0; s < grid.columns; ++s) {
        const auto seen =
            project_from_plane(camera, camera_from_sample, grid.centre(s, first_row + static_cast<int>(row)));
        if (!seen) continue;
        Footprint footprint;
        footprint.middle = seen->pixel;
        footprint.along_s = {w * seen->by_plane[0], w * seen->by_plane[2]};
        footprint.along_t = {h * seen->by_plane[1], h * seen->by_plane[3]};
        footprint.steps_s = steps_for(footprint.along_s);
        footprint.steps_t = steps_for(footprint.along_t);
        const std::size_t texel = row * static_cast<std::size_t>(grid.columns) + static_cast<std::size_t>(s);
        out.state[texel] = gatherer.gather(footprint, &out.value[3 * texel], &out.variance[3 * texel]);
      }
    }
  });
  return out;
}

}  // namespace rig::calibration
