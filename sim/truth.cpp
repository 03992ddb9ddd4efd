#include "sim/truth.h"

#include <algorithm>

#include "core/base/config.h"
#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/maps/observation_map.h"
#include "core/maps/parameter_map.h"
#include "sim/chart.h"
#include "sim/world.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr int kSide = 3;  // points a texel: kSide x kSide

Result<World> world_of(const std::string& rig) {
  auto root = base::ConfigTable::parse_file(rig);
  if (!root) return pass(root);
  for (const base::ConfigTable& module : root->tables("module")) {
    if (module.text("file") != "virtual") continue;
    const World world = read_world(module.table("settings"));
    if (auto ok = module.noted(); !ok) return pass(ok);
    return world;
  }
  return fail(ErrorCode::bad_input, "has no [[module]] with file = \"virtual\"", rig);
}

// A pose's true geometry: frame of the sample, camera and light in it.
struct TruePose {
  V3 camera, light;
};

TruePose true_pose(const World& world, maps::PoseGeometry& pose) {
  Angles angles{};
  for (std::size_t i = 0; i < kAxes; ++i) {
    angles[i] = true_angle(world, i, counts_of(world.axes[i], pose.target_rad[i]), false);
  }
  const Frame frame = sample_frame(world, angles);
  const TruePose out{frame.in(camera_position(world)), frame.in(light_position(world, angles))};
  pose.camera_m = {out.camera.x, out.camera.y, out.camera.z};
  pose.light_m = {out.light.x, out.light.y, out.light.z, 1};
  const V3 o = frame.origin - camera_position(world);
  // The camera's x is the bench's, y and z are reversed.
  pose.camera_from_sample = {frame.x.x,  frame.y.x, frame.z.x,  o.x,        -frame.x.y, -frame.y.y,
                             -frame.z.y, -o.y,      -frame.x.z, -frame.y.z, -frame.z.z, -o.z};
  pose.registration_rms_px = 0;
  return out;
}

Result<void> write_regions(const std::filesystem::path& path, const maps::ObservationHeader& like) {
  maps::ParameterMap map;
  map.columns = like.columns;
  map.rows = like.rows;
  map.width_m = like.width_m;
  map.height_m = like.height_m;
  map.model = "truth";
  for (std::size_t i = 0; i < region_names().size(); ++i) {
    map.attributes["region." + std::to_string(i)] = region_names()[i];
  }
  for (const char* name : {"region", "alpha", "albedo.R", "albedo.G", "albedo.B"}) map.add(name);
  for (int t = 0; t < like.rows; ++t) {
    for (int s = 0; s < like.columns; ++s) {
      const Spot spot = spot_at(1e3 * ((s + 0.5) / like.columns - 0.5) * like.width_m,
                                1e3 * ((t + 0.5) / like.rows - 0.5) * like.height_m);
      const auto albedo = spot_albedo(spot);
      const std::size_t i =
          static_cast<std::size_t>(t) * static_cast<std::size_t>(like.columns) + static_cast<std::size_t>(s);
      map.channels[0].values[i] = static_cast<float>(spot.region);
      map.channels[1].values[i] = static_cast<float>(spot_alpha(spot));
      for (std::size_t c = 0; c < 3; ++c) map.channels[2 + c].values[i] = static_cast<float>(albedo[c]);
    }
  }
  return maps::write_parameter_map(path, map);
}

}  // namespace

Result<void> write_truth(const TruthOptions& options) {
  auto world = world_of(options.rig);
  if (!world) return pass(world);
  auto like = maps::ObservationReader::open(options.like);
  if (!like) return pass(like);
  maps::ObservationHeader header = like->header();
  const int every = options.every;
  const int fine_columns = header.columns;
  const int fine_rows = header.rows;
  header.columns = (header.columns + every - 1) / every;
  header.rows = (header.rows + every - 1) / every;
  header.absolute = true;
  header.quantity = maps::Quantity::brdf;
  header.provenance = {{"program", "rig-virtual-truth"}, {"every", std::to_string(every)}};
  std::vector<TruePose> poses;
  for (maps::PoseGeometry& pose : header.poses) {
    if (!std::isfinite(pose.target_rad[0])) {
      return fail(ErrorCode::bad_input, "its poses have no motor angles: it is not of the virtual rig",
                  options.like.string());
    }
    poses.push_back(true_pose(*world, pose));
  }
  auto writer = maps::ObservationWriter::create(options.out, header);
  if (!writer) return pass(writer);
  base::Progress progress("truth", static_cast<std::size_t>(header.rows), "rows");
  for (int first = 0; first < header.rows; first += maps::kTile) {
    if (base::interrupted()) return base::interrupted_error("no truth was written");
    maps::ObservationBlock block;
    block.first_row = first;
    block.rows = std::min(maps::kTile, header.rows - first);
    block.columns = header.columns;
    block.poses = static_cast<int>(poses.size());
    block.allocate();
    base::parallel_for(static_cast<std::size_t>(block.rows) * static_cast<std::size_t>(block.columns), 8,
                       [&](std::size_t begin, std::size_t end) {
                         for (std::size_t texel = begin; texel < end; ++texel) {
                           const int t = static_cast<int>(texel) / block.columns;
                           const int s = static_cast<int>(texel) % block.columns;
                           for (std::size_t p = 0; p < poses.size(); ++p) {
                             const std::size_t at = block.texel_index(t, s) + p;
                             for (int k = 0; k < kSide * kSide; ++k) {
                               const double u = s * every + (k % kSide + 0.5) / kSide;
                               const double v = (first + t) * every + (k / kSide + 0.5) / kSide;
                               const V3 point{(u / fine_columns - 0.5) * header.width_m,
                                              (v / fine_rows - 0.5) * header.height_m, 0};
                               const V3 wi = unit(poses[p].light - point);
                               const V3 wr = unit(poses[p].camera - point);
                               const Spot spot = spot_at(1e3 * point.x, 1e3 * point.y);
                               for (int c = 0; c < 3; ++c) {
                                 block.value[3 * at + static_cast<std::size_t>(c)] +=
                                     static_cast<float>(spot_brdf(spot, wi, wr, c) / (kSide * kSide));
                               }
                               if (wi.z > 0 && wr.z > 0) block.validity[at] = maps::Validity::good;
                             }
                           }
                         }
                       });
    if (auto ok = writer->write(block); !ok) return ok;
    progress.add(static_cast<std::size_t>(block.rows));
  }
  if (auto ok = writer->finish(); !ok) return ok;
  std::filesystem::path regions = options.out;
  regions.replace_extension("regions.exr");
  return write_regions(regions, like->header());
}

}  // namespace rig::sim
