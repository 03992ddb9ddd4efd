#include "clients/fit/fit_map.h"

#include <algorithm>

#include "appearance/texel.h"
#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/maps/parameter_map.h"

namespace rig::fit {

using appearance::Fit;
using base::ErrorCode;
using base::Result;

namespace {

// The channels in the order of `values_of`.
const std::vector<std::string>& channel_names() {
  static const std::vector<std::string> names{"rho_d.R",       "rho_d.G",       "rho_d.B",  "lobe1.rho_s.R",
                                              "lobe1.rho_s.G", "lobe1.rho_s.B", "lobe1.Cx", "lobe1.Cy",
                                              "lobe1.Cz",      "lobe1.n",       "residual", "count"};
  return names;
}

std::vector<double> values_of(const Fit& fit) {
  const auto& m = fit.model;
  return {m.rho_d[0], m.rho_d[1], m.rho_d[2], m.rho_s[0], m.rho_s[1],   m.rho_s[2],
          m.cx,       m.cy,       m.cz,       m.n,        fit.residual, static_cast<double>(fit.count)};
}

// What would cost the whole fit, or the observations themselves, if it were noticed only at the end.
Result<void> check(const Options& options) {
  if (options.model != "lafortune" && options.model != "diffuse") {
    return base::fail(ErrorCode::bad_input, "there is no model '" + options.model + "'", {},
                      "lafortune or diffuse");
  }
  if (options.leave_out < 0 || options.leave_out == 1) {
    return base::fail(ErrorCode::bad_input,
                      fmt::format("holding every {}th pose out leaves nothing to fit to", options.leave_out),
                      {}, "0 holds none out, 10 every tenth");
  }
  std::error_code absent;
  if (std::filesystem::equivalent(options.out, options.observation, absent)) {
    return base::fail(ErrorCode::refused, "is the observation map itself", options.out.string(),
                      "name another file to write to");
  }
  if (std::filesystem::is_directory(options.out, absent)) {
    return base::fail(ErrorCode::refused, "is a folder; a file cannot take its place", options.out.string());
  }
  const std::filesystem::path folder = options.out.parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder, absent)) {
    return base::fail(ErrorCode::not_found, "there is no such folder to write into", folder.string());
  }
  return {};
}

}  // namespace

Result<void> fit_map(const Options& options) {
  if (auto ok = check(options); !ok) return ok;
  auto reader = maps::ObservationReader::open(options.observation);
  if (!reader) return base::pass(reader);
  const maps::ObservationHeader& header = reader->header();
  if (header.quantity != maps::Quantity::brdf) {
    return base::fail(ErrorCode::bad_input, "holds radiance; these models are of the BRDF",
                      options.observation.string());
  }
  std::vector<bool> use(header.poses.size(), true);
  std::string held_out;
  for (std::size_t p = 0; p < use.size(); ++p) {
    if (options.leave_out > 0 && (p + 1) % static_cast<std::size_t>(options.leave_out) == 0) {
      use[p] = false;
      held_out += (held_out.empty() ? "" : " ") + std::to_string(p);
    }
  }
  maps::ParameterMap map;
  map.columns = header.columns;
  map.rows = header.rows;
  map.width_m = header.width_m;
  map.height_m = header.height_m;
  map.model = options.model;
  map.attributes = header.provenance;
  map.attributes["name"] = header.name;
  map.attributes["held_out"] = held_out;
  map.attributes["program"] = "rig-fit";
  map.attributes["units.rho_d"] = map.attributes["units.rho_s"] = "sr^-1";
  map.attributes["units.residual"] = "sr^-1, of f cos(theta_i), luminance";
  for (const std::string& name : channel_names()) map.add(name);
  base::Progress progress("fit " + options.model,
                          static_cast<std::size_t>(header.rows) * static_cast<std::size_t>(header.columns),
                          "texels");
  for (int row = 0; row < header.rows; row += maps::kTile) {
    if (base::interrupted()) return base::interrupted_error("no map was written; fit again");
    const int rows = std::min(maps::kTile, header.rows - row);
    auto block = reader->read(row, rows, 0, header.columns);
    if (!block) return base::pass(block);
    const auto texels = static_cast<std::size_t>(rows) * static_cast<std::size_t>(header.columns);
    base::parallel_for(texels, 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const int t = static_cast<int>(i) / header.columns;
        const int s = static_cast<int>(i) % header.columns;
        const auto samples = appearance::samples_of(header, *block, t, s, use);
        const Fit fit = options.model == "diffuse" ? appearance::fit_diffuse(samples)
                                                   : appearance::fit_lafortune(samples);
        const auto values = values_of(fit);
        const std::size_t texel =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(header.columns) + i;
        for (std::size_t c = 0; c < values.size(); ++c)
          map.channels[c].values[texel] = static_cast<float>(values[c]);
      }
      progress.add(end - begin);
    });
  }
  return maps::write_parameter_map(options.out, map);
}

}  // namespace rig::fit
