// The nodes on one CAN bus: questions that wait for their answers, orders that do not, and what nodes say
// unasked.
#pragma once

#include <functional>
#include <linux/can.h>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/log.h"
#include "drivers/cia402_axis/can_bus.h"
#include "drivers/cia402_axis/node_monitor.h"
#include "drivers/cia402_axis/sdo.h"
#include "drivers/cia402_axis/settings.h"
#include "drivers/common/connection.h"

namespace rig::drivers::cia402 {

/// NMT commands of CiA 301.
enum class NmtCommand : std::uint8_t { start = 0x01, stop = 0x02, pre_operational = 0x80, reset = 0x81 };

/// All of one bus is used from its one worker. Every function with a deadline returns by then. A bus that is
/// down or bus-off, and a node that gives no answer or misses its heartbeat, are `lost`; an object that a
/// node does not have is `not_found`, one that it refuses to read or write a `device` error.
class Network {
 public:
  using Log = std::function<void(base::LogLevel, const std::string&)>;

  Network(NetworkSettings settings, const std::vector<int>& nodes, base::Clock& clock, Log log);

  [[nodiscard]] const NetworkSettings& settings() const { return settings_; }

  /// Takes in what has come. Opens the bus where it is not.
  [[nodiscard]] base::Result<void> listen();
  /// Whether a node's heartbeat is in time, of what listen() took in.
  [[nodiscard]] base::Result<void> alive(int node);

  /// Grows when the bus was opened anew or was bus-off: what was believed of any node is void.
  [[nodiscard]] int generation() const { return bus_.times_opened() + times_bus_off_; }
  /// Whether a node's server has answered anything within the time that a question may take.
  [[nodiscard]] bool has_answered_lately(int node) {
    return Steady::now() - node_at(node).last_answer < settings_.retry.longest();
  }
  [[nodiscard]] NodeMonitor& monitor(int node) { return node_at(node).monitor; }

  /// Reads an object, its bytes in the order of the wire.
  [[nodiscard]] base::Result<std::string> upload(int node, Object object, Steady::time_point deadline);
  /// Writes an object. May be done twice without harm, as every object of this driver.
  [[nodiscard]] base::Result<void> download(int node, Object object, std::string_view bytes,
                                            Steady::time_point deadline);
  /// As download, for what must not wait: whatever the node's server may still be busy with is aborted first.
  [[nodiscard]] base::Result<void> download_at_once(int node, Object object, std::string_view bytes,
                                                    Steady::time_point deadline);

  /// Hands over one frame that nobody answers.
  [[nodiscard]] base::Result<void> send(const can_frame& frame, Steady::time_point deadline);
  [[nodiscard]] base::Result<void> command(NmtCommand command, int node, Steady::time_point deadline);

  /// "can0, node 3"
  [[nodiscard]] std::string where(int node) const;

 private:
  struct Node {
    explicit Node(int id) : monitor(id) {}
    NodeMonitor monitor;
    Steady::time_point last_answer{};
    /// A question went unanswered: its answer may still come.
    bool answer_outstanding = false;
    /// The object of that question.
    Object outstanding{};
  };

  [[nodiscard]] Node& node_at(int node) { return nodes_.at(node); }
  [[nodiscard]] base::Result<std::string> transfer(int node, SdoTransfer transfer, Object object,
                                                   Steady::time_point deadline);
  [[nodiscard]] base::Result<std::string> attempt(CanBus& bus, int node, SdoTransfer transfer, Object object,
                                                  Steady::time_point deadline);
  [[nodiscard]] base::Result<void> fence(CanBus& bus, int node, Object object, Steady::time_point deadline);
  void take(const can_frame& frame);
  [[nodiscard]] base::Result<void> take_all(CanBus& bus);
  [[nodiscard]] base::Result<void> on_the_bus() const;

  const NetworkSettings settings_;
  const std::vector<canid_t> heard_;
  Log log_;
  Connection<CanBus> bus_;
  std::map<int, Node> nodes_;
  bool is_bus_off_ = false;
  int times_bus_off_ = 0;
  std::string last_warning_;
};

}  // namespace rig::drivers::cia402
