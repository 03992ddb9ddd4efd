#include "drivers/v4l2_camera/configure.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

#include "drivers/v4l2_camera/device_error.h"
#include "drivers/v4l2_camera/image_setup.h"

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::pass;
using base::Result;

namespace {

constexpr double kAbsoluteUnit_s = 100e-6;  // of V4L2_CID_EXPOSURE_ABSOLUTE

// What a camera may do of its own accord, and the value that ends it.
struct Automatic {
  std::uint32_t id;
  std::int32_t off;
};
constexpr std::array<Automatic, 13> kAutomatic{
    {{V4L2_CID_AUTOGAIN, 0},
     {V4L2_CID_AUTO_WHITE_BALANCE, 0},
     {V4L2_CID_AUTO_N_PRESET_WHITE_BALANCE, V4L2_WHITE_BALANCE_MANUAL},
     {V4L2_CID_AUTOBRIGHTNESS, 0},
     {V4L2_CID_HUE_AUTO, 0},
     {V4L2_CID_CHROMA_AGC, 0},
     {V4L2_CID_BACKLIGHT_COMPENSATION, 0},
     {V4L2_CID_WIDE_DYNAMIC_RANGE, 0},
     {V4L2_CID_ISO_SENSITIVITY_AUTO, V4L2_ISO_SENSITIVITY_MANUAL},
     {V4L2_CID_SCENE_MODE, V4L2_SCENE_MODE_NONE},
     {V4L2_CID_IMAGE_STABILIZATION, 0},
     {V4L2_CID_FOCUS_AUTO, 0},
     {V4L2_CID_POWER_LINE_FREQUENCY, 0}}};

using Controls = std::vector<Control>;

std::string control_names(const Controls& controls) {
  std::string text;
  for (const Control& control : controls) {
    if (control.usable) text += (text.empty() ? "" : ", ") + control.name;
  }
  return text.empty() ? "none" : text;
}

Result<std::string> identify(VideoNode& node) {
  v4l2_capability said{};
  if (const int error = node.request(VIDIOC_QUERYCAP, &said); error != 0) {
    if (error == ENOTTY || error == EINVAL) return fail(ErrorCode::bad_input, "it is no video device");
    return failed_to("to say what it is", error);
  }
  const std::uint32_t can =
      (said.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? said.device_caps : said.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return fail(ErrorCode::bad_input,
                (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                    ? "its frames are in several planes: this driver takes those in one"
                    : "it captures no video",
                {}, "a camera may have several nodes, of which the first is the one");
  }
  if ((can & V4L2_CAP_STREAMING) == 0) return fail(ErrorCode::bad_input, "it cannot map its buffers");
  const auto text = [](const unsigned char* from, std::size_t room) {
    return std::string(reinterpret_cast<const char*>(from),
                       static_cast<std::size_t>(std::find(from, from + room, 0) - from));
  };
  return text(said.card, sizeof said.card) + " at " + text(said.bus_info, sizeof said.bus_info);
}

Result<void> claim(VideoNode& node) {
  if (node.claim() == EBUSY) return failed_to("to be ours alone", EBUSY);
  return {};
}

Result<void> set_to(VideoNode& node, const Control& control, std::int32_t value) {
  const auto reads = set_control(node, control, value);
  if (!reads) return pass(reads);
  if (*reads == value) return {};
  return fail(ErrorCode::device, fmt::format("{} was set to {} and reads {}", control.name, value, *reads));
}

Result<void> end_automatics(VideoNode& node, const Controls& controls) {
  for (const Automatic& automatic : kAutomatic) {
    const Control* control = find_control(controls, automatic.id);
    if (control == nullptr) continue;
    if (control->kind == ControlKind::menu && !has_menu_item(node, *control, automatic.off)) continue;
    const std::int32_t off = std::clamp(automatic.off, control->min, control->max);
    if (auto done = set_to(node, *control, off); !done) return done;
  }
  return {};
}

Result<void> end_automatic_exposure(VideoNode& node, const Controls& controls) {
  const Control* control = find_control(controls, V4L2_CID_EXPOSURE_AUTO);
  if (control == nullptr) return {};
  for (const std::int32_t item : {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY}) {
    if (has_menu_item(node, *control, item)) return set_to(node, *control, item);
  }
  return fail(ErrorCode::device,
              "its exposure cannot be set by hand: its menu has neither manual nor shutter priority");
}

Result<void> set_what_was_asked(VideoNode& node, const Settings& settings, const Controls& controls) {
  for (const auto& [name, value] : settings.controls) {
    const Control* control = find_control(controls, name);
    if (control == nullptr) {
      return fail(ErrorCode::bad_input,
                  fmt::format("it has no control {}; it has {}", name, control_names(controls)));
    }
    const bool on_step = control->kind != ControlKind::number || control->nearest(value) == value;
    if (value < control->min || value > control->max || !on_step) {
      return fail(ErrorCode::bad_input, fmt::format("its {} takes {} to {} in steps of {}, not {}", name,
                                                    control->min, control->max, control->step, value));
    }
    if (auto done = set_to(node, *control, value); !done) return done;
  }
  return {};
}

Result<ExposureControl> find_exposure(const Settings& settings, const Controls& controls) {
  if (const Control* absolute = find_control(controls, V4L2_CID_EXPOSURE_ABSOLUTE)) {
    return ExposureControl{*absolute, settings.exposure_unit_s.value_or(kAbsoluteUnit_s)};
  }
  const Control* lines = find_control(controls, V4L2_CID_EXPOSURE);
  if (lines != nullptr && settings.exposure_unit_s) return ExposureControl{*lines, *settings.exposure_unit_s};
  if (lines != nullptr) {
    return fail(ErrorCode::bad_input, "its exposure control counts in units of its own, usually lines", {},
                "exposure_unit_us says how long one is");
  }
  return fail(ErrorCode::bad_input,
              fmt::format("it has no exposure control; it has {}", control_names(controls)), {},
              "fixed_exposure_ms says how it exposes");
}

Result<void> set_up_exposure(VideoNode& node, const Settings& settings, const Controls& controls,
                             Configured& made) {
  if (settings.fixed_exposure_s) {
    made.min_exposure_s = made.max_exposure_s = *settings.fixed_exposure_s;
    return {};
  }
  if (auto done = end_automatic_exposure(node, controls); !done) return done;
  auto found = find_exposure(settings, controls);
  if (!found) return pass(found);
  const Control& control = found->control;
  std::int64_t least = control.min;
  if (least < 1) least += (control.step - least) / control.step * control.step;
  made.min_exposure_s = static_cast<double>(least) * found->unit_s;
  made.max_exposure_s = control.max * found->unit_s;
  if (settings.longest_exposure_s) {
    made.max_exposure_s = std::min(made.max_exposure_s, *settings.longest_exposure_s);
  }
  if (made.min_exposure_s > made.max_exposure_s) {
    return fail(ErrorCode::bad_input,
                fmt::format("it cannot expose: its {} takes {} to {}, of {} us each", control.name,
                            control.min, control.max, found->unit_s * 1e6));
  }
  made.exposure = std::move(*found);
  return {};
}

Result<void> set_up_gain(const Settings& settings, const Controls& controls, Configured& made) {
  const Control* control = nullptr;
  if (!settings.gain_control.empty()) {
    control = find_control(controls, settings.gain_control);
    if (control == nullptr) {
      return fail(ErrorCode::bad_input, fmt::format("it has no control {}; it has {}", settings.gain_control,
                                                    control_names(controls)));
    }
  } else {
    control = find_control(controls, V4L2_CID_ANALOGUE_GAIN);
    if (control == nullptr) control = find_control(controls, V4L2_CID_GAIN);
  }
  if (control == nullptr) return {};
  const double one = gain_value(settings.gain, 1);
  if (!(one >= control->min && one <= control->max)) {
    return fail(ErrorCode::bad_input,
                fmt::format("its {} takes {} to {}, and gain 1 would be {}", control->name, control->min,
                            control->max, one),
                {}, "gain_unit, gain_counts and gain_offset say what it counts");
  }
  made.gain = *control;
  return {};
}

}  // namespace

Result<Configured> configure(VideoNode& node, const Settings& settings, const Log& log) {
  Configured made;
  auto card = identify(node);
  if (!card) return pass(card);
  made.card = *card;
  if (settings.exclusive) {
    if (auto done = claim(node); !done) return pass(done);
  }
  auto layout = set_format(node, settings);
  if (!layout) return pass(layout);
  made.layout = *layout;
  made.image_bytes = image_bytes(settings.format.packing, *layout);
  const auto interval = set_interval(node, settings);
  if (!interval) return pass(interval);
  made.interval_s = *interval;
  const auto controls = list_controls(node);
  if (!controls) return pass(controls);
  if (auto done = end_automatics(node, *controls); !done) return pass(done);
  if (auto done = set_up_exposure(node, settings, *controls, made); !done) return pass(done);
  if (auto done = set_what_was_asked(node, settings, *controls); !done) return pass(done);
  if (auto done = set_up_gain(settings, *controls, made); !done) return pass(done);
  log(LogLevel::debug,
      fmt::format("{}: {}, controls {}", settings.called(), made.card, control_names(*controls)));
  return made;
}

}  // namespace rig::drivers::v4l2
