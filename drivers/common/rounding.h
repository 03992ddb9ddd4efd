// Whole numbers for a device's registers.
#pragma once

namespace rig::drivers {

enum class Rounding { nearest, down, up };

/// A number that is whole but for the last bits of its conversion is that number, whichever way it is
/// rounded. No number stays none.
[[nodiscard]] double rounded(double exact, Rounding how);

}  // namespace rig::drivers
