// From photoelectrons per second to what the camera's electronics deliver.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/world.h"

namespace rig::sim {

/// Digital numbers of one exposure: photon noise, read noise, gain, black level, saturation, quantisation.
/// The expected photoelectrons of a pixel are electrons_per_s times `effective_s`, the exposure times the
/// light's level. The noise is a function of `key` and the pixel's index alone.
void expose(const CameraWorld& camera, std::span<const float> electrons_per_s, double effective_s,
            double gain, std::uint64_t key, std::span<std::uint16_t> out);

}  // namespace rig::sim
