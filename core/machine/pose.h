// The four angles of the rig.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace rig::machine {

/// Order of the axes everywhere: arrays, files, messages.
enum class AxisId : std::size_t { roll = 0, tilt = 1, pan = 2, arm = 3 };
inline constexpr std::size_t kAxisCount = 4;
inline constexpr std::array<std::string_view, kAxisCount> kAxisNames{"roll", "tilt", "pan", "arm"};

/// Joint angles in radians, indexed by AxisId. Zero faces the sample to the camera; arm is the light's angle
/// from the camera's axis, about the pan axis.
using JointAngles = std::array<double, kAxisCount>;

}  // namespace rig::machine
