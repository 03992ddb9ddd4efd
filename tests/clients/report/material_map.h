// Parameter maps of tests.
#pragma once

#include "core/maps/parameter_map.h"
#include "tests/clients/known_map.h"

namespace rig::test {

/// The map whose texels are those of `material`, as rig-fit would write it.
inline maps::ParameterMap map_of(const maps::ObservationHeader& header, const Material& material,
                                 const std::string& model = "lafortune") {
  maps::ParameterMap map;
  map.columns = header.columns;
  map.rows = header.rows;
  map.width_m = header.width_m;
  map.height_m = header.height_m;
  map.model = model;
  const auto fill = [&](const std::string& name,
                        const std::function<double(const appearance::Lafortune&)>& get) {
    auto& channel = map.add(name);
    for (int t = 0; t < map.rows; ++t) {
      for (int s = 0; s < map.columns; ++s) {
        channel.values[static_cast<std::size_t>(t * map.columns + s)] =
            static_cast<float>(get(material(s, t)));
      }
    }
  };
  for (std::size_t c = 0; c < 3; ++c) {
    const std::string colour(1, "RGB"[c]);
    fill("rho_d." + colour, [c](const auto& m) { return m.rho_d[c]; });
    fill("lobe1.rho_s." + colour, [c](const auto& m) { return m.rho_s[c]; });
  }
  fill("lobe1.Cx", [](const auto& m) { return m.cx; });
  fill("lobe1.Cy", [](const auto& m) { return m.cy; });
  fill("lobe1.Cz", [](const auto& m) { return m.cz; });
  fill("lobe1.n", [](const auto& m) { return m.n; });
  return map;
}

/// Truth of a virtual rig about regions: everything is region 0 with this roughness.
inline maps::ParameterMap regions_of(const maps::ObservationHeader& header, float alpha) {
  maps::ParameterMap map;
  map.columns = header.columns;
  map.rows = header.rows;
  map.width_m = header.width_m;
  map.height_m = header.height_m;
  map.model = "truth";
  map.add("region");
  for (float& v : map.add("alpha").values) v = alpha;
  return map;
}

}  // namespace rig::test
