#include "sim/wire/uvc_controls.h"

#include <algorithm>

#include "sim/wire/uvc_descriptors.h"

namespace rig::sim::wire {

namespace {

using uvc_number_of::kCamera;
using uvc_number_of::kOutput;
using uvc_number_of::kProcessing;

// Where they stand in the table, and their selectors (A.9.4, A.9.5).
enum Place : std::size_t { kMode, kPriority, kExposure, kBrightness, kGain };
constexpr std::uint8_t kAeMode = 0x02, kAePriority = 0x03, kExposureAbsolute = 0x04;
constexpr std::uint8_t kPuBrightness = 0x02, kPuGain = 0x04;

std::vector<std::uint8_t> bytes_of(std::uint32_t value, std::size_t bytes) {
  std::vector<std::uint8_t> made;
  uvc_append(made, value, bytes);
  return made;
}

bool acceptable(const UvcControls::Control& control, std::uint32_t value) {
  if (control.ranged) return value >= control.least && value <= control.most;
  const bool one_bit = value != 0 && (value & (value - 1)) == 0;
  if (control.selector == kAeMode) return one_bit && (value & control.resolution) != 0;
  return value <= 1;
}

}  // namespace

std::array<UvcControls::Control, 5> UvcControls::initial() {
  const auto ranged = [](std::uint8_t unit, std::uint8_t selector, std::uint8_t bytes, std::uint32_t least,
                         std::uint32_t most, std::uint32_t value) {
    return Control{unit, selector, bytes, true, least, most, 1, value, value};
  };
  const std::uint32_t modes = uvc_ae::kManual | uvc_ae::kAperturePriority;
  const std::uint32_t mode = uvc_ae::kAperturePriority;
  return {Control{kCamera, kAeMode, 1, false, 0, 0, modes, mode, mode},
          Control{kCamera, kAePriority, 1, false, 0, 0, 0, 0, 0},
          ranged(kCamera, kExposureAbsolute, 4, kUvcLeast.exposure_100us, kUvcMost.exposure_100us,
                 kUvcDefault.exposure_100us),
          ranged(kProcessing, kPuBrightness, 2, kUvcLeast.brightness, kUvcMost.brightness,
                 kUvcDefault.brightness),
          ranged(kProcessing, kPuGain, 2, kUvcLeast.gain, kUvcMost.gain, kUvcDefault.gain)};
}

UvcSettings UvcControls::settings() const {
  return {controls_[kExposure].value, controls_[kGain].value, controls_[kBrightness].value};
}

bool UvcControls::automatic() const {
  return controls_[kMode].value != uvc_ae::kManual;
}

bool UvcControls::may_slow_down() const {
  return controls_[kPriority].value != 0;
}

std::uint8_t UvcControls::info(const Control& control) const {
  constexpr unsigned int kGet = 1, kSet = 2, kDisabledByAutomatic = 4, kAutoUpdate = 8;
  if (control.selector != kExposureAbsolute || control.unit != kCamera) return kGet | kSet;
  return static_cast<std::uint8_t>(kGet | kSet | kAutoUpdate | (automatic() ? kDisabledByAutomatic : 0));
}

UvcReply UvcControls::set(Control& control, std::span<const std::uint8_t> out) {
  if (out.size() != control.bytes) return UvcReply::refused(UvcError::invalid_request);
  if (&control == &controls_[kExposure] && automatic()) return UvcReply::refused(UvcError::wrong_state);
  const std::uint32_t value = uvc_number(out);
  if (!acceptable(control, value)) return UvcReply::refused(UvcError::out_of_range);
  control.value = value;
  return {};
}

UvcReply UvcControls::answer(const SetupPacket& setup, std::span<const std::uint8_t> out) {
  const auto unit = static_cast<std::uint8_t>(setup.index >> 8U);
  const auto selector = static_cast<std::uint8_t>(setup.value >> 8U);
  if (unit != kCamera && unit != kProcessing && unit != kOutput) {
    return UvcReply::refused(UvcError::invalid_unit);
  }
  const auto found = std::find_if(controls_.begin(), controls_.end(), [&](const Control& each) {
    return each.unit == unit && each.selector == selector;
  });
  if (found == controls_.end() || (setup.value & 0xFFU) != 0) {
    return UvcReply::refused(UvcError::invalid_control);
  }
  Control& control = *found;
  if (setup.is_in() != (setup.request != uvc_request::kSetCur)) {
    return UvcReply::refused(UvcError::invalid_request);
  }
  const auto value = [&](std::uint32_t of, bool known = true) {
    return known ? UvcReply::with(bytes_of(of, control.bytes)) : UvcReply::refused(UvcError::invalid_request);
  };
  const bool is_priority = selector == kAePriority && unit == kCamera;
  switch (setup.request) {
    case uvc_request::kSetCur:
      return set(control, out);
    case uvc_request::kGetCur:
      return value(control.value);
    case uvc_request::kGetMin:
      return value(control.least, control.ranged);
    case uvc_request::kGetMax:
      return value(control.most, control.ranged);
    case uvc_request::kGetRes:
      return value(control.resolution, !is_priority);
    case uvc_request::kGetDef:
      return value(control.initial, !is_priority);
    case uvc_request::kGetLen:
      return UvcReply::with(bytes_of(control.bytes, 2));
    case uvc_request::kGetInfo:
      return UvcReply::with({info(control)});
    default:
      return UvcReply::refused(UvcError::invalid_request);
  }
}

std::optional<std::vector<std::uint8_t>> UvcControls::expose_automatically(std::uint32_t exposure_100us) {
  Control& exposure = controls_[kExposure];
  const std::uint32_t value = std::clamp(exposure_100us, exposure.least, exposure.most);
  if (value == exposure.value) return std::nullopt;
  exposure.value = value;
  constexpr std::uint8_t kFromControlInterface = 1, kControlChange = 0, kItsValue = 0;
  std::vector<std::uint8_t> packet{kFromControlInterface, kCamera, kControlChange, kExposureAbsolute,
                                   kItsValue};
  uvc_append(packet, value, exposure.bytes);
  return packet;
}

}  // namespace rig::sim::wire
