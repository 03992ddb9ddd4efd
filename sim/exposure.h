// From photoelectrons per second to what the camera's electronics deliver.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/world.h"

namespace rig::sim {

/// Digital numbers of one exposure: photon noise, read noise, gain, black level, quantisation, saturation.
/// The noise is a function of `key` and the pixel's index alone.
void expose(const CameraWorld& camera, const std::vector<float>& electrons_per_s, double exposure_s,
            double gain, std::uint64_t key, std::span<std::uint16_t> out);

}  // namespace rig::sim
