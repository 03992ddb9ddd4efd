// Between a gain, which is a factor, and the camera's gain feature.
#pragma once

#include "drivers/aravis_camera/settings.h"

namespace rig::drivers::aravis {

/// The feature's value for a factor; `whole`: it takes whole numbers only, and the nearest is taken. A factor
/// that is none (0, negative, no number) gives no number.
[[nodiscard]] double gain_value(const Settings& settings, bool whole, double factor);

/// The inverse.
[[nodiscard]] double gain_factor(const Settings& settings, double value);

}  // namespace rig::drivers::aravis
