// Between a gain, which is a factor, and the camera's gain control.
#pragma once

#include "drivers/v4l2_camera/settings.h"

namespace rig::drivers::v4l2 {

/// The control's value for a factor, before it is rounded. A factor that is none (0, negative, no number)
/// gives no number.
[[nodiscard]] double gain_value(const Settings& settings, double factor);

/// The inverse.
[[nodiscard]] double gain_factor(const Settings& settings, double value);

}  // namespace rig::drivers::v4l2
