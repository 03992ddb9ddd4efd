#include "drivers/v4l2_camera/controls.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <thread>

#include "drivers/v4l2_camera/device_error.h"

namespace rig::drivers::v4l2 {

using base::Result;

namespace {

// More than any driver has; a device that never comes to an end is not followed for ever.
constexpr std::size_t kMostControls = 1000;
// A camera may still be busy with the setting before.
constexpr std::chrono::milliseconds kReadyWithin{500}, kAskEvery{10};

ControlKind kind_of(std::uint32_t type) {
  switch (type) {
    case V4L2_CTRL_TYPE_INTEGER:
      return ControlKind::number;
    case V4L2_CTRL_TYPE_BOOLEAN:
      return ControlKind::yes_no;
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
      return ControlKind::menu;
    default:
      return ControlKind::other;
  }
}

int request_when_ready(VideoNode& node, unsigned long code, v4l2_control& value) {
  using Steady = std::chrono::steady_clock;
  const v4l2_control asked = value;
  const auto until = Steady::now() + kReadyWithin;
  while (true) {
    value = asked;
    const int error = node.request(code, &value);
    if (error != EBUSY || Steady::now() >= until || node.is_claimed_by_another()) return error;
    std::this_thread::sleep_for(kAskEvery);
  }
}

}  // namespace

std::int32_t Control::nearest(double value) const {
  if (!(value > min)) return min;
  if (value >= max) return max;
  const double steps = std::round((value - min) / step);
  const double most = std::floor((static_cast<double>(max) - min) / step);
  return static_cast<std::int32_t>(min + std::min(steps, most) * step);
}

std::string control_name(const unsigned char* said, std::size_t room) {
  std::string name;
  bool gap = false;
  for (std::size_t i = 0; i < room && said[i] != 0; ++i) {
    const unsigned char c = said[i];
    const bool upper = c >= 'A' && c <= 'Z';
    if (upper || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
      if (gap && !name.empty()) name += '_';
      gap = false;
      name += static_cast<char>(upper ? c - 'A' + 'a' : c);
    } else {
      gap = true;
    }
  }
  return name;
}

Control read_control(const v4l2_queryctrl& said) {
  Control control;
  control.id = said.id & V4L2_CTRL_ID_MASK;
  control.name = control_name(said.name, sizeof said.name);
  control.kind = kind_of(said.type);
  control.min = said.minimum;
  control.max = said.maximum;
  control.step = said.step;
  control.usual = said.default_value;
  control.usable = control.kind != ControlKind::other &&
                   (said.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) == 0;
  if (control.min > control.max) {
    control.usable = false;
    std::swap(control.min, control.max);
  }
  // Some drivers leave it 0 where it has no meaning.
  if (control.step < 1) control.step = 1;
  return control;
}

Result<std::vector<Control>> list_controls(VideoNode& node) {
  std::vector<Control> controls;
  v4l2_queryctrl asked{};
  asked.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  std::uint32_t last = 0;
  while (controls.size() < kMostControls) {
    const int error = node.request(VIDIOC_QUERYCTRL, &asked);
    if (error == EINVAL || error == ENOTTY) break;
    if (error != 0) return control_failed_to(node, "to list its controls", error);
    const std::uint32_t id = asked.id & V4L2_CTRL_ID_MASK;
    if (id <= last) break;
    last = id;
    if (asked.type != V4L2_CTRL_TYPE_CTRL_CLASS) controls.push_back(read_control(asked));
    asked = {};
    asked.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

const Control* find_control(const std::vector<Control>& controls, std::uint32_t id) {
  const auto found = std::find_if(controls.begin(), controls.end(),
                                  [&](const Control& c) { return c.id == id && c.usable; });
  return found == controls.end() ? nullptr : &*found;
}

const Control* find_control(const std::vector<Control>& controls, const std::string& name) {
  const auto found = std::find_if(controls.begin(), controls.end(),
                                  [&](const Control& c) { return c.name == name && c.usable; });
  return found == controls.end() ? nullptr : &*found;
}

bool has_menu_item(VideoNode& node, const Control& control, std::int32_t item) {
  if (item < control.min || item > control.max) return false;
  v4l2_querymenu asked{};
  asked.id = control.id;
  asked.index = static_cast<std::uint32_t>(item);
  return node.request(VIDIOC_QUERYMENU, &asked) == 0;
}

Result<std::int32_t> get_control(VideoNode& node, const Control& control) {
  v4l2_control value{};
  value.id = control.id;
  if (const int error = request_when_ready(node, VIDIOC_G_CTRL, value); error != 0) {
    return control_failed_to(node, fmt::format("to tell {}", control.name), error);
  }
  return value.value;
}

Result<std::int32_t> set_control(VideoNode& node, const Control& control, std::int32_t value) {
  v4l2_control wanted{};
  wanted.id = control.id;
  wanted.value = value;
  if (const int error = request_when_ready(node, VIDIOC_S_CTRL, wanted); error != 0) {
    return control_failed_to(node, fmt::format("to set {} to {}", control.name, value), error);
  }
  return get_control(node, control);
}

}  // namespace rig::drivers::v4l2
