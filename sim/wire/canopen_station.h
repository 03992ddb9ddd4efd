// Simulated CANopen nodes at work: a thread that carries frames between them and a bus.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sim/wire/canopen_node.h"

namespace rig::sim::wire {

class CanopenStation {
 public:
  /// `fd`: a socket that carries a struct can_frame in each packet (a place on a CanHub, or a raw CAN
  /// socket); it is closed at the end. All nodes have power.
  CanopenStation(int fd, const std::vector<CanopenNode::Settings>& nodes);
  ~CanopenStation();
  CanopenStation(const CanopenStation&) = delete;
  CanopenStation& operator=(const CanopenStation&) = delete;

  /// `use(node, now)` while no frame passes. A node that is not there is an exception.
  template <typename Use>
  auto with(int id, Use&& use) {
    const std::lock_guard lock(mutex_);
    return std::forward<Use>(use)(node(id), std::chrono::steady_clock::now());
  }
  [[nodiscard]] std::vector<int> ids() const;

  /// Called with each frame from and to the nodes, from the station's thread.
  void listen(std::function<void(const can_frame&)> listener);
  /// The cable of all nodes is out: they go on by themselves.
  void unplug(bool out);
  /// Power gone and back; returns when the node has booted.
  void power_cycle(int id);

 private:
  void run();
  [[nodiscard]] CanopenNode& node(int id);

  const int fd_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<CanopenNode>> nodes_;
  std::function<void(const can_frame&)> listener_;
  bool is_out_ = false;
  bool ends_ = false;
  std::thread thread_;
};

/// A raw socket on a SocketCAN interface, for a station. What fails is an exception.
[[nodiscard]] int open_can_interface(const std::string& name);

}  // namespace rig::sim::wire
