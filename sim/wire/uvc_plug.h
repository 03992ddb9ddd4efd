// The simulated USB video camera at this machine's USB.
#pragma once

#include <memory>

#include "core/base/result.h"
#include "sim/wire/uvc_camera.h"
#include "sim/wire/vhci.h"

namespace rig::sim::wire {

class UvcPlug {
 public:
  /// Refers to the camera, which must live longer. Nothing is plugged in yet.
  explicit UvcPlug(UvcCamera& camera) : camera_(camera) {}
  ~UvcPlug();
  UvcPlug(const UvcPlug&) = delete;
  UvcPlug& operator=(const UvcPlug&) = delete;

  /// Needs root and the kernel module vhci-hcd. Nothing happens if it is plugged in.
  [[nodiscard]] base::Result<void> plug();
  void unplug();

 private:
  UvcCamera& camera_;
  std::unique_ptr<VhciPlug> plugged_;
};

}  // namespace rig::sim::wire
