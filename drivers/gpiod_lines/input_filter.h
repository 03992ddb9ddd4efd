// Whether an input was active since the last look, from its changes and its level. The first version of the
// kernel's interface does not debounce, so that it is done here, by the times of the changes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "drivers/gpiod_lines/line_chip.h"

namespace rig::drivers::gpiod_lines {

/// Without a debounce every moment counts. With one, only what was active for at least so long on end. Where
/// so many changes came that the kernel may have dropped some, the input counts as active whatever they say.
class InputFilter {
 public:
  explicit InputFilter(std::int64_t debounce_ns) : debounce_ns_(debounce_ns) {}

  /// `edges`: the changes since the last look. `level`: as it is behind the last of them, at `now_ns`. The
  /// first look counts an active level whatever the debounce: nobody knows since when it is so.
  [[nodiscard]] bool look(std::span<const Edge> edges, bool level, std::int64_t now_ns);

 private:
  [[nodiscard]] bool lasted(std::int64_t until_ns) const;
  [[nodiscard]] bool fold(const Edge& edge);

  const std::int64_t debounce_ns_;
  bool first_ = true;
  bool active_ = false;
  std::optional<std::int64_t> since_ns_;  // active since then; nothing: for long
  // The level at that time told of a change to inactive whose edge had not come yet.
  std::optional<std::int64_t> owed_ns_;
};

}  // namespace rig::drivers::gpiod_lines
