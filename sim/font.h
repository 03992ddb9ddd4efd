// Capital letters and digits on a grid of 5 x 7 cells.
#pragma once

#include <string_view>

namespace rig::sim {

/// Whether ink lies at (x, y) mm of a line of text whose letters are `height_mm` high; the lower left corner
/// of the first letter is the origin. Letters are 5/7 of their height wide and stand 6/7 apart.
[[nodiscard]] bool inked(std::string_view text, double height_mm, double x_mm, double y_mm);

}  // namespace rig::sim
