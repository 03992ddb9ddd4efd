// After how many frames a camera shows a setting: judged by the brightness of its frames.
#pragma once

#include <optional>
#include <span>

namespace rig::drivers::v4l2 {

/// Of frames that began after a setting was changed, the first that shows it, and all after it do. `before`:
/// the level ahead of the change. Nothing where the change cannot be seen: it is smaller than `least`, or
/// drowns in how the last levels differ, or has not come to its end.
[[nodiscard]] std::optional<int> settled_at(double before, std::span<const double> levels, double least);

}  // namespace rig::drivers::v4l2
