// A CAN bus without a cable: every frame that one of those on it sends reaches all others, whole and in
// order.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <linux/can.h>
#include <memory>

namespace rig::sim::wire {

/// Any thread may call it. Drivers connect to a SOCK_SEQPACKET unix socket, each packet one struct can_frame.
class CanHub {
 public:
  /// Listens at `path`.
  explicit CanHub(std::filesystem::path path);
  ~CanHub();
  CanHub(const CanHub&) = delete;
  CanHub& operator=(const CanHub&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// A place on the bus for a simulated node: its descriptor, which the caller closes.
  [[nodiscard]] int attach();

  enum class Fault {
    drop,
    garble,  ///< other bytes in place of its own
    delay,   ///< by `late`; what follows it under the same identifier waits behind it
    duplicate,
    drop_two_of_three,  ///< only each third comes
  };
  /// The next `frames` frames with this identifier are spoilt. Several orders are carried out one after the
  /// other.
  void spoil(Fault fault, canid_t id, int frames, std::chrono::milliseconds late = {});
  /// Forgets all orders to spoil, and the frames that wait.
  void heal();

  /// As `ip link set ... down`: those who connected are hung up, and the path is gone. Simulated nodes stay.
  void take_down();
  void bring_up();
  /// The controller of those who connected leaves the bus, and comes back: they get the error frames of
  /// SocketCAN, and nothing passes from or to them in between.
  void set_bus_off(bool off);
  /// A frame of the test's own, to those who connected.
  void inject(const can_frame& frame);

  /// Called with each frame as it came in, before it is spoilt, from the hub's thread.
  void listen(std::function<void(const can_frame&)> listener);

 private:
  struct State;
  void run();

  const std::filesystem::path path_;
  std::unique_ptr<State> state_;
};

}  // namespace rig::sim::wire
