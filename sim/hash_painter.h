// Frames painted from a hash: for runs in which it only matters that they are the right ones.
#pragma once

#include <cstdint>
#include <span>

#include "sim/world.h"

namespace rig::sim {

/// Fills `out` with samples that are a function of `key`, `effective_s` (exposure times light) and the
/// pixel's index alone: from the black level up, wider with more light, never beyond saturation.
void paint_hashed(const CameraWorld& camera, double effective_s, double gain, std::uint64_t key,
                  std::span<std::uint16_t> out);

}  // namespace rig::sim
