#include "appearance/lafortune.h"

#include <cmath>

namespace rig::appearance {

double lobe(const Lafortune& m, geometry::Vec3 wi, geometry::Vec3 wr) {
  const double s = m.cx * wi.x * wr.x + m.cy * wi.y * wr.y + m.cz * wi.z * wr.z;
  return s > 0 ? std::pow(s, m.n) : 0.0;
}

double evaluate(const Lafortune& m, geometry::Vec3 wi, geometry::Vec3 wr, std::size_t channel) {
  return m.rho_d[channel] + m.rho_s[channel] * lobe(m, wi, wr);
}

}  // namespace rig::appearance
