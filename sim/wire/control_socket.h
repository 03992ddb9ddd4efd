// A USB device's control transfers over a Unix socket, for tests of drivers on machines without a USB bus to
// plug into. A message to the device is a tag of four bytes, the eight bytes of the setup packet and the data
// stage; its answer is the same tag, a byte (0: done, 1: stall) and the data stage. Packets, so that messages
// keep their bounds (SOCK_SEQPACKET).
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>

#include "sim/wire/usb.h"

namespace rig::sim::wire {

/// Listens at `path` and answers with `handler` from a thread of its own, until destroyed.
class ControlSocket {
 public:
  enum class Spoil {
    missing,       ///< the request is carried out and its answer never comes
    garbage,       ///< other bytes come in the answer's place
    late,          ///< the answer comes `late` after its time
    duplicate,     ///< the answer comes twice
    two_of_three,  ///< only each third comes
  };

  ControlSocket(std::filesystem::path path, ControlHandler handler);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const;
  /// Spoils so many of the next answers; none: what was asked for before is taken back.
  void spoil(Spoil how, int answers, std::chrono::milliseconds late = std::chrono::milliseconds(400));
  /// The plug is pulled: whoever is connected is thrown out and nobody comes in until restore(). The device
  /// itself goes on. Returns when it is so.
  void cut();
  void restore();
  /// Whether somebody is connected.
  [[nodiscard]] bool in_use();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rig::sim::wire
