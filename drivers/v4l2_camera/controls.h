// The controls of a video device: what it says of them, and values that they take.
#pragma once

#include <cstdint>
#include <linux/videodev2.h>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

enum class ControlKind { number, yes_no, menu, other };

/// A control as VIDIOC_QUERYCTRL describes it.
struct Control {
  std::uint32_t id = 0;
  std::string name;  ///< "exposure_time_absolute", as v4l2-ctl writes it
  ControlKind kind = ControlKind::number;
  std::int32_t min = 0, max = 0, step = 1;  ///< min <= max, step >= 1
  std::int32_t usual = 0;                   ///< its default
  bool usable = true;                       ///< a value that can be set

  /// The value that it can take which is nearest; of a menu the same, whether it has that item or not.
  [[nodiscard]] std::int32_t nearest(double value) const;
};

/// Checks what a device says of itself: a control whose range contradicts itself is not `usable`, its name is
/// never longer than its field.
[[nodiscard]] Control read_control(const v4l2_queryctrl& said);
/// "Exposure Time, Absolute" as "exposure_time_absolute". Reads no further than `room`.
[[nodiscard]] std::string control_name(const unsigned char* said, std::size_t room);

/// All controls, in the order of their numbers. A device without any: none.
[[nodiscard]] base::Result<std::vector<Control>> list_controls(VideoNode& node);
/// nullptr: there is none, or it cannot be set.
[[nodiscard]] const Control* find_control(const std::vector<Control>& controls, std::uint32_t id);
[[nodiscard]] const Control* find_control(const std::vector<Control>& controls, const std::string& name);

[[nodiscard]] bool has_menu_item(VideoNode& node, const Control& control, std::int32_t item);

/// A camera that is not ready for it is asked again for up to half a second, here and below.
[[nodiscard]] base::Result<std::int32_t> get_control(VideoNode& node, const Control& control);
/// What the control reads back afterwards.
[[nodiscard]] base::Result<std::int32_t> set_control(VideoNode& node, const Control& control,
                                                     std::int32_t value);

}  // namespace rig::drivers::v4l2
