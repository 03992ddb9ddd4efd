#include "sim/wire/v4l2_sensor.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace rig::sim::wire {

namespace {

constexpr std::uint32_t kAbsolute_us = 100;
constexpr std::uint32_t kLine_us = 20;
constexpr std::uint32_t kFixed_us = 5000;
constexpr std::uint32_t kAutomatic_us = 3000;

}  // namespace

V4l2Sensor::V4l2Sensor(ExposureKind exposure, int delay_frames, int gain_min)
    : exposure_(exposure), delay_frames_(delay_frames) {
  const auto number = [](std::uint32_t id, const char* name, std::int32_t min, std::int32_t max,
                         std::int32_t step, std::int32_t usual) {
    return Control{id, V4L2_CTRL_TYPE_INTEGER, name, min, max, step, usual, usual, 0, {}};
  };
  const auto yes_no = [](std::uint32_t id, const char* name, std::int32_t usual) {
    return Control{id, V4L2_CTRL_TYPE_BOOLEAN, name, 0, 1, 1, usual, usual, 0, {}};
  };
  const auto menu = [](std::uint32_t id, const char* name, std::vector<std::string> items,
                       std::int32_t usual) {
    const auto last = static_cast<std::int32_t>(items.size()) - 1;
    return Control{id, V4L2_CTRL_TYPE_MENU, name, 0, last, 1, usual, usual, 0, std::move(items)};
  };
  controls_ = {number(V4L2_CID_BRIGHTNESS, "Brightness", -64, 64, 1, 0),
               yes_no(V4L2_CID_AUTO_WHITE_BALANCE, "White Balance, Automatic", 1),
               yes_no(V4L2_CID_AUTOGAIN, "Gain, Automatic", 1),
               number(V4L2_CID_GAIN, "Gain", gain_min, 255, 1, std::max(gain_min, 8)),
               menu(V4L2_CID_POWER_LINE_FREQUENCY, "Power Line Frequency", {"Disabled", "50 Hz", "60 Hz"}, 2),
               number(V4L2_CID_BACKLIGHT_COMPENSATION, "Backlight Compensation", 0, 2, 1, 1)};
  if (exposure_ == ExposureKind::lines) {
    controls_.push_back(number(V4L2_CID_EXPOSURE, "Exposure", 4, 65535, 1, 1000));
  }
  if (exposure_ == ExposureKind::absolute) {
    controls_.push_back(menu(V4L2_CID_EXPOSURE_AUTO, "Auto Exposure",
                             {"", "Manual Mode", "", "Aperture Priority Mode"},
                             V4L2_EXPOSURE_APERTURE_PRIORITY));
    controls_.push_back(number(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 1, 5000, 1, 157));
  }
  Control temperature = number(V4L2_CID_CAMERA_CLASS_BASE + 200, "Sensor Temperature", -40, 120, 1, 31);
  temperature.flags = V4L2_CTRL_FLAG_READ_ONLY;
  controls_.push_back(temperature);
  std::sort(controls_.begin(), controls_.end(),
            [](const Control& a, const Control& b) { return a.id < b.id; });
}

const V4l2Sensor::Control* V4l2Sensor::find(std::uint32_t id) const {
  const auto found =
      std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) { return c.id == id; });
  return found == controls_.end() ? nullptr : &*found;
}

int V4l2Sensor::query_control(v4l2_queryctrl& about) const {
  const Control* control = nullptr;
  if ((about.id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0) {
    const std::uint32_t after = about.id & V4L2_CTRL_ID_MASK;
    for (const Control& candidate : controls_) {
      if (candidate.id > after) {
        control = &candidate;
        break;
      }
    }
  } else {
    control = find(about.id);
  }
  if (control == nullptr) return EINVAL;
  about = {};
  about.id = control->id;
  about.type = control->type;
  about.minimum = control->min;
  about.maximum = control->max;
  about.step = control->step;
  about.default_value = control->usual;
  about.flags = control->flags;
  const bool exposes = control->id == V4L2_CID_EXPOSURE_ABSOLUTE;
  if (exposes && !is_manual()) about.flags |= V4L2_CTRL_FLAG_INACTIVE;
  std::memcpy(about.name, control->name.data(), std::min(control->name.size(), sizeof about.name - 1));
  return 0;
}

int V4l2Sensor::query_menu(v4l2_querymenu& about) const {
  const Control* control = find(about.id);
  if (control == nullptr || control->type != V4L2_CTRL_TYPE_MENU) return EINVAL;
  if (about.index >= control->menu.size() || control->menu[about.index].empty()) return EINVAL;
  const std::string& item = control->menu[about.index];
  std::memset(about.name, 0, sizeof about.name);
  std::memcpy(about.name, item.data(), std::min(item.size(), sizeof about.name - 1));
  return 0;
}

int V4l2Sensor::get_control(v4l2_control& value) const {
  const Control* control = find(value.id);
  if (control == nullptr) return EINVAL;
  value.value = control->value;
  return 0;
}

// As the kernel's control framework does it: numbers are brought into range and onto their step, items that
// are none are refused.
int V4l2Sensor::set_control(const v4l2_control& value) {
  const auto control =
      std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) { return c.id == value.id; });
  if (control == controls_.end()) return EINVAL;
  if ((control->flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) return EACCES;
  if (control->type == V4L2_CTRL_TYPE_MENU) {
    if (value.value < 0 || value.value > control->max) return ERANGE;
    if (control->menu[static_cast<std::size_t>(value.value)].empty()) return EINVAL;
    control->value = value.value;
    return 0;
  }
  if (control->type == V4L2_CTRL_TYPE_BOOLEAN) {
    control->value = value.value != 0 ? 1 : 0;
    return 0;
  }
  const std::int64_t inside = std::clamp(value.value, control->min, control->max);
  const std::int64_t steps = (inside - control->min + control->step / 2) / control->step;
  control->value = static_cast<std::int32_t>(control->min + steps * control->step);
  return 0;
}

bool V4l2Sensor::is_manual() const {
  const Control* automatic = find(V4L2_CID_EXPOSURE_AUTO);
  return automatic == nullptr || automatic->value == V4L2_EXPOSURE_MANUAL;
}

V4l2Sensor::Setting V4l2Sensor::setting() const {
  Setting now{kFixed_us, 0};
  const auto value = [&](std::uint32_t id) { return static_cast<std::uint32_t>(find(id)->value); };
  if (exposure_ == ExposureKind::absolute) now.exposure_us = value(V4L2_CID_EXPOSURE_ABSOLUTE) * kAbsolute_us;
  if (exposure_ == ExposureKind::lines) now.exposure_us = value(V4L2_CID_EXPOSURE) * kLine_us;
  now.gain = static_cast<std::uint8_t>(value(V4L2_CID_GAIN));
  // What is automatic wanders, and with it whatever somebody measures.
  if (!is_manual()) now.exposure_us = kAutomatic_us + drift_ % 7 * 100;
  if (value(V4L2_CID_AUTOGAIN) != 0) now.gain = static_cast<std::uint8_t>(40 + drift_ % 5);
  if (value(V4L2_CID_BACKLIGHT_COMPENSATION) != 0) now.exposure_us += drift_ % 3 * 100;
  return now;
}

VideoFacts V4l2Sensor::begin_frame(std::uint32_t number) {
  ++drift_;
  pipeline_.push_back(setting());
  while (pipeline_.size() > static_cast<std::size_t>(delay_frames_) + 1) pipeline_.pop_front();
  return {pipeline_.front().exposure_us, number, pipeline_.front().gain, light_};
}

void V4l2Sensor::power_cycle() {
  for (Control& control : controls_) control.value = control.usual;
  pipeline_.clear();
}

std::int32_t V4l2Sensor::value_of(const std::string& name) const {
  for (const Control& control : controls_) {
    if (control.name == name) return control.value;
  }
  return -1;
}

}  // namespace rig::sim::wire
