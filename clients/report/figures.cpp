#include "clients/report/figures.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include "appearance/texel.h"
#include "core/base/units.h"

namespace rig::report {

using base::pass;
using base::Result;
using geometry::RigidTransform;
using geometry::Vec3;

namespace {

constexpr float kRough = 0.08F;  // SGD alpha from which a region counts as rough; as exact as a map is
constexpr double kSteepest_deg = 60;
constexpr std::array<double, 3> kLuminance{0.2126, 0.7152, 0.0722};

double theta_deg(Vec3 d) {
  return base::degrees(std::atan2(std::hypot(d.x, d.y), d.z));
}

RigidTransform transform_of(const maps::PoseGeometry& pose) {
  const auto& m = pose.camera_from_sample;
  return {{{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}}, {m[3], m[7], m[11]}};
}

// Where, in the sample plane as registered, the camera sees what truly is at `point`.
Vec3 seen_at(const RigidTransform& truth, const RigidTransform& registered, Vec3 point) {
  const RigidTransform sample_from_camera = geometry::inverse(registered);
  const Vec3 centre = sample_from_camera.translation;
  const Vec3 ray = sample_from_camera.direction(truth.point(point));
  return centre + (-centre.z / ray.z) * ray;
}

// The whole text as a number from 0 on.
std::optional<int> natural_number(const std::string& text) {
  int number = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stopped != end || number < 0) return std::nullopt;
  return number;
}

// Texels along an edge of which every so manieth is known.
int coarse(int texels, int every) {
  return (texels - 1) / every + 1;
}

}  // namespace

appearance::Lafortune model_at(const maps::ParameterMap& map, std::size_t texel) {
  const auto value = [&](const char* name) {
    const maps::Channel* channel = map.find(name);
    return channel != nullptr ? static_cast<double>(channel->values[texel]) : 0.0;
  };
  return {{value("rho_d.R"), value("rho_d.G"), value("rho_d.B")},
          {value("lobe1.rho_s.R"), value("lobe1.rho_s.G"), value("lobe1.rho_s.B")},
          value("lobe1.Cx"),
          value("lobe1.Cy"),
          value("lobe1.Cz"),
          value("lobe1.n")};
}

Result<View> make_view(const maps::ObservationReader& observation, int pose,
                       const std::vector<maps::ParameterMap>& maps, const maps::ParameterMap* regions) {
  const maps::ObservationHeader& header = observation.header();
  auto block = observation.read_pose(pose);
  if (!block) return pass(block);
  const auto grid = appearance::grid_of(header);
  const maps::PoseGeometry& geometry = header.poses[static_cast<std::size_t>(pose)];
  const auto centre = appearance::directions_at(geometry, {0, 0, 0});
  const maps::Channel* alpha = regions != nullptr ? regions->find("alpha") : nullptr;
  View view;
  view.pose = pose;
  view.incident_deg = theta_deg(centre.incident);
  view.exitant_deg = theta_deg(centre.exitant);
  view.photograph = {header.columns, header.rows, std::vector<float>(block->value.size(), 0.0F)};
  view.renderings.assign(maps.size(), view.photograph);
  struct Sums {
    double d = 0, dd = 0, a = 0, rough = 0;
    std::size_t n = 0, rough_n = 0;
  };
  std::vector<Sums> sums(maps.size());
  for (int t = 0; t < header.rows; ++t) {
    for (int s = 0; s < header.columns; ++s) {
      const std::size_t texel = block->texel_index(t, s);
      const auto d = appearance::directions_at(geometry, grid.centre(s, t));
      if (d.incident.z <= 0 || d.exitant.z <= 0) continue;
      const maps::Validity validity = block->validity[texel];
      const bool seen = validity == maps::Validity::good || validity == maps::Validity::dark;
      for (std::size_t c = 0; c < 3; ++c) {
        view.photograph.rgb[3 * texel + c] =
            static_cast<float>(static_cast<double>(block->value[3 * texel + c]) * d.incident.z);
      }
      for (std::size_t m = 0; m < maps.size(); ++m) {
        const auto model = model_at(maps[m], texel);
        const double lobe = appearance::lobe(model, d.incident, d.exitant);
        double difference = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const double rendered = (model.rho_d[c] + model.rho_s[c] * lobe) * d.incident.z;
          view.renderings[m].rgb[3 * texel + c] = static_cast<float>(rendered);
          difference += kLuminance[c] * (rendered - static_cast<double>(view.photograph.rgb[3 * texel + c]));
        }
        if (!seen) continue;
        Sums& sum = sums[m];
        sum.d += difference;
        sum.dd += difference * difference;
        sum.a += std::abs(difference);
        ++sum.n;
        if (alpha != nullptr && alpha->values[texel] >= kRough) {
          sum.rough += std::abs(difference);
          ++sum.rough_n;
        }
      }
    }
  }
  for (const Sums& sum : sums) {
    const auto n = static_cast<double>(std::max<std::size_t>(sum.n, 1));
    const double mean = sum.d / n;
    view.errors.push_back({mean, std::sqrt(std::max(0.0, sum.dd / n - mean * mean)), sum.a / n, sum.n});
    if (alpha != nullptr)
      view.rough_error.push_back(sum.rough / static_cast<double>(std::max<std::size_t>(sum.rough_n, 1)));
  }
  return view;
}

Result<TruthFigures> compare_with_truth(const maps::ObservationReader& observation,
                                        const std::filesystem::path& path) {
  auto truth = maps::ObservationReader::open(path);
  if (!truth) return pass(truth);
  const maps::ObservationHeader& header = observation.header();
  const maps::ObservationHeader& true_header = truth->header();
  const auto found = true_header.provenance.find("every");
  const int every = found != true_header.provenance.end() ? natural_number(found->second).value_or(0) : 0;
  const auto same_row = [](const maps::PoseGeometry& a, const maps::PoseGeometry& b) {
    return a.row == b.row;
  };
  if (every <= 0 || true_header.columns != coarse(header.columns, every) ||
      true_header.rows != coarse(header.rows, every) || true_header.width_m != header.width_m ||
      true_header.height_m != header.height_m ||
      !std::equal(header.poses.begin(), header.poses.end(), true_header.poses.begin(),
                  true_header.poses.end(), same_row)) {
    return base::fail(base::ErrorCode::bad_input, "is not the truth of this observation map", path.string(),
                      "make it with rig virtual-truth --like");
  }
  TruthFigures figures;
  double sum = 0;
  std::size_t points = 0;
  std::vector<bool> moderate(header.poses.size());
  for (std::size_t p = 0; p < header.poses.size(); ++p) {
    const auto d = appearance::directions_at(true_header.poses[p], {0, 0, 0});
    moderate[p] = theta_deg(d.exitant) <= kSteepest_deg && theta_deg(d.incident) <= kSteepest_deg;
    if (theta_deg(d.exitant) > kSteepest_deg) continue;
    ++figures.registered_poses;
    const RigidTransform a = transform_of(true_header.poses[p]);
    const RigidTransform b = transform_of(header.poses[p]);
    for (int i = 0; i < 81; ++i) {
      const int column = i % 9;
      const int row = i / 9;
      const Vec3 point{(column / 8.0 - 0.5) * header.width_m, (row / 8.0 - 0.5) * header.height_m, 0};
      const Vec3 off = seen_at(a, b, point) - point;
      sum += dot(off, off);
      ++points;
    }
  }
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  figures.registration_rms_mm = points > 0 ? 1e3 * std::sqrt(sum / static_cast<double>(points)) : kNotKnown;
  std::vector<float> errors;
  for (int t = 0; t < true_header.rows; ++t) {
    auto measured = observation.read(t * every, 1, 0, header.columns);
    if (!measured) return pass(measured);
    auto known = truth->read(t, 1, 0, true_header.columns);
    if (!known) return pass(known);
    for (int s = 0; s < true_header.columns; ++s) {
      for (std::size_t p = 0; p < header.poses.size(); ++p) {
        const std::size_t at = measured->texel_index(0, s * every) + p;
        const std::size_t is = known->texel_index(0, s) + p;
        if (!moderate[p] || measured->validity[at] != maps::Validity::good) continue;
        for (std::size_t c = 0; c < 3; ++c) {
          const float truly = known->value[3 * is + c];
          if (truly > 0) errors.push_back(std::abs(measured->value[3 * at + c] - truly) / truly);
        }
      }
    }
  }
  figures.values = errors.size();
  figures.reflectance_error = errors.empty() ? kNotKnown : percentile(std::move(errors), 0.5);
  return figures;
}

std::vector<int> held_out_poses(const maps::ParameterMap& map) {
  std::vector<int> poses;
  const auto found = map.attributes.find("held_out");
  if (found == map.attributes.end()) return poses;
  std::istringstream words(found->second);
  for (std::string word; words >> word;) {
    const auto pose = natural_number(word);
    if (pose && std::find(poses.begin(), poses.end(), *pose) == poses.end()) poses.push_back(*pose);
  }
  return poses;
}

}  // namespace rig::report
