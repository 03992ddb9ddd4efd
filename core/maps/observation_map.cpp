#include "core/maps/observation_map.h"

#include "core/maps/observation_layout.h"

namespace rig::maps {

void ObservationBlock::allocate() {
  const std::size_t n = observations(*this);
  value.assign(3 * n, 0.0F);
  variance.assign(3 * n, 0.0F);
  validity.assign(n, Validity::missing);
}

}  // namespace rig::maps
