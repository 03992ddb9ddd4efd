// [lines] of rig.toml: which inputs and outputs play a part.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/config.h"
#include "core/machine/pose.h"

namespace rig::machine {

/// Which device of which driver module plays a part.
struct DeviceRef {
  std::string module;  ///< name of a [[module]]
  std::string device;  ///< name that the module gives its device
  friend bool operator==(const DeviceRef&, const DeviceRef&) = default;
};

/// One line of a digital I/O device.
struct LineRef {
  DeviceRef device;
  std::string line;
};

/// The output that triggers the camera.
struct TriggerLine {
  LineRef line;
  double pulse_s = 0.001;
};

/// The two ends of an axis' travel, as indices.
inline constexpr std::size_t kLow = 0, kHigh = 1, kEnds = 2;
inline constexpr std::array<std::string_view, kEnds> kEndNames{"low", "high"};

/// Inputs that are active while an axis stands on the limit switch of that end; none where the switch goes to
/// the drive, or where there is none.
using LimitLines = std::array<std::optional<LineRef>, kEnds>;

struct LinesConfig {
  std::optional<LineRef> emergency_stop;      ///< input that says the hardware cut drive power
  std::optional<TriggerLine> camera_trigger;  ///< none: by the camera's own command
  std::array<LimitLines, kAxisCount> limit;
};

/// Reads the table; a line has one part. `read_device` reads the keys `module` and `device` of a table.
[[nodiscard]] LinesConfig read_lines(const base::ConfigTable& lines,
                                     const std::function<DeviceRef(const base::ConfigTable&)>& read_device);

/// A line and what it is for.
struct LinePart {
  std::string part;  ///< "lines.limit.roll.low"
  LineRef line;
};
[[nodiscard]] std::vector<LinePart> line_parts(const LinesConfig& lines);

/// "lines.limit.roll.low".
[[nodiscard]] std::string limit_part(std::size_t axis, std::size_t end);

/// What messages call a device of lines: "lines" where only one is named, else "lines MODULE/DEVICE".
[[nodiscard]] std::string lines_name(const LinesConfig& lines, const DeviceRef& device);

}  // namespace rig::machine
