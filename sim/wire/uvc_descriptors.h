// The descriptors of the simulated USB video camera (UVC 1.1, chapter 3): a camera terminal, a processing
// unit and a streaming interface with one bulk endpoint.
#pragma once

#include <string>

#include "sim/wire/usb.h"

namespace rig::sim::wire {

/// Interfaces, entities and endpoints, as their descriptors number them.
namespace uvc_number_of {
inline constexpr std::uint8_t kControlInterface = 0, kStreamingInterface = 1;
inline constexpr std::uint8_t kCamera = 1, kProcessing = 2, kOutput = 3;
inline constexpr std::uint8_t kVideoEndpoint = 1, kStatusEndpoint = 2;  // both towards the host
}  // namespace uvc_number_of

[[nodiscard]] UsbDescription uvc_description(const std::string& serial);

}  // namespace rig::sim::wire
