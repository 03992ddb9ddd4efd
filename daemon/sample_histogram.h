// What a frame shows of the sample, as far as an exposure strategy needs it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace rig::daemon {

/// Pixels inside the sample's outline by colour (geometry::Colour) and raw value. The last place of each list
/// is the saturation level and everything above; a colour that the sensor has not is empty.
struct SampleHistogram {
  std::array<std::vector<std::uint32_t>, 3> counts;
};

}  // namespace rig::daemon
