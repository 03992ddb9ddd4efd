// The kernel's virtual USB host controller (module vhci-hcd): plugs a device of ours into this machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "core/base/result.h"
#include "sim/wire/usbip_device.h"

namespace rig::sim::wire {

enum class UsbSpeed { low = 1, full = 2, high = 3 };

inline constexpr const char* kVhci = "/sys/devices/platform/vhci_hcd.0";

/// The first free port for devices up to high speed in the controller's table (its file `status`).
[[nodiscard]] std::optional<int> free_vhci_port(std::string_view status);

/// A device that is plugged in while this lives.
class VhciPlug {
 public:
  /// Without the module, without the rights (root) or without a free port: an Error that says so.
  [[nodiscard]] static base::Result<std::unique_ptr<VhciPlug>> plug_in(
      ControlHandler control, UsbSpeed speed, UsbIpDevice::OutHandler out = {},
      const std::filesystem::path& vhci = kVhci);
  ~VhciPlug();
  VhciPlug(const VhciPlug&) = delete;
  VhciPlug& operator=(const VhciPlug&) = delete;

  [[nodiscard]] UsbIpDevice& device() { return *device_; }
  [[nodiscard]] int port() const { return port_; }

 private:
  VhciPlug(std::filesystem::path vhci, int port, std::unique_ptr<UsbIpDevice> device)
      : vhci_(std::move(vhci)), port_(port), device_(std::move(device)) {}

  const std::filesystem::path vhci_;
  const int port_;
  std::unique_ptr<UsbIpDevice> device_;
};

}  // namespace rig::sim::wire
