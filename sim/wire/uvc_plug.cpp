#include "sim/wire/uvc_plug.h"

namespace rig::sim::wire {

UvcPlug::~UvcPlug() {
  unplug();
}

base::Result<void> UvcPlug::plug() {
  if (plugged_) return {};
  auto made =
      VhciPlug::plug_in([this](const SetupPacket& setup,
                               std::span<const std::uint8_t> out) { return camera_.control(setup, out); },
                        UsbSpeed::high);
  if (!made) return base::pass(made);
  plugged_ = std::move(*made);
  UsbIpDevice& device = plugged_->device();
  camera_.connect({[&device](std::uint8_t endpoint, std::vector<std::uint8_t> data) {
                     device.send(endpoint, std::move(data));
                   },
                   [&device](std::uint8_t endpoint) { return device.unfetched(endpoint); },
                   [&device](std::uint8_t endpoint) { device.forget(endpoint); }});
  return {};
}

void UvcPlug::unplug() {
  camera_.disconnect();
  plugged_.reset();
}

}  // namespace rig::sim::wire
