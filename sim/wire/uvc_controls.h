// The controls of the simulated USB video camera's terminal and processing unit (UVC 1.1, 4.2.2).
#pragma once

#include <array>
#include <optional>

#include "sim/wire/usb.h"
#include "sim/wire/uvc_request.h"

namespace rig::sim::wire {

/// Of bAutoExposureMode, those that this camera has.
namespace uvc_ae {
inline constexpr std::uint8_t kManual = 0x01, kAperturePriority = 0x08;
}  // namespace uvc_ae

/// What a frame is taken with, in the units of the controls.
struct UvcSettings {
  std::uint32_t exposure_100us = 0;
  std::uint32_t gain = 0;        ///< 16 is once
  std::uint32_t brightness = 0;  ///< the black level, in 1/4096 of the full scale
  [[nodiscard]] bool operator==(const UvcSettings&) const = default;
};

/// Bounds and power-up values: mode aperture priority, where the camera exposes as it thinks fit.
inline constexpr UvcSettings kUvcLeast{1, 16, 0}, kUvcMost{20'000, 255, 255}, kUvcDefault{156, 16, 64};

class UvcControls {
 public:
  /// A class request to an entity, that is with its number in the high byte of wIndex. While the camera
  /// exposes automatically the exposure is not the host's to set (wrong_state).
  [[nodiscard]] UvcReply answer(const SetupPacket& setup, std::span<const std::uint8_t> out);

  [[nodiscard]] UvcSettings settings() const;
  [[nodiscard]] bool automatic() const;
  /// Whether an automatic exposure may make the frames slower.
  [[nodiscard]] bool may_slow_down() const;
  /// The camera's own choice. The packet that tells the host of it (2.4.2.2), or nothing where it is no news.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> expose_automatically(std::uint32_t exposure_100us);

  struct Control {
    std::uint8_t unit, selector;
    std::uint8_t bytes;
    bool ranged;  ///< knows its least and greatest value; else only its resolution, a set of bits
    std::uint32_t least, most, resolution, initial;
    std::uint32_t value;
  };

 private:
  [[nodiscard]] UvcReply set(Control& control, std::span<const std::uint8_t> out);
  [[nodiscard]] std::uint8_t info(const Control& control) const;

  std::array<Control, 5> controls_ = initial();
  [[nodiscard]] static std::array<Control, 5> initial();
};

}  // namespace rig::sim::wire
