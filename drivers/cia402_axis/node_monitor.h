// What a CANopen node says unasked: that it booted, that it lives, that something is wrong.
#pragma once

#include <chrono>
#include <cstdint>
#include <linux/can.h>
#include <optional>

#include "drivers/cia402_axis/emergency.h"

namespace rig::drivers::cia402 {

enum class NmtState : std::uint8_t {
  booting = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F
};

/// Pure: frames and times are given. Frames that are none of this node's, or not formed as CiA 301 says, are
/// passed over.
class NodeMonitor {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit NodeMonitor(int node) : node_(static_cast<canid_t>(node)) {}

  void hear(const can_frame& frame, Time now);

  /// How often it has booted while it was listened to: what was believed of it before is void.
  [[nodiscard]] int boots() const { return boots_; }
  /// Of the last heartbeat, or as it was started since.
  [[nodiscard]] std::optional<NmtState> nmt() const { return nmt_; }
  /// It was told to be operational; its next heartbeat says whether it is.
  void started() { nmt_ = NmtState::operational; }
  [[nodiscard]] std::optional<Time> last_heartbeat() const { return last_heartbeat_; }

  /// Begins to expect heartbeats, each at most `within` after the one before.
  void expect_heartbeats(Time now, std::chrono::milliseconds within);
  /// Nothing is expected of a node that is gone, or that sends no heartbeats.
  void expect_nothing() { within_.reset(); }
  [[nodiscard]] bool is_overdue(Time now) const { return within_ && now - expected_since_ > *within_; }

  /// The last emergency that told of an error. The drive's own "the errors are gone" takes it back once it
  /// was told(): what came and went between two looks is seen too.
  [[nodiscard]] const std::optional<Emergency>& emergency() const { return emergency_; }
  void told();
  /// A person has taken note of it.
  void acknowledge() { emergency_.reset(); }

 private:
  canid_t node_;
  int boots_ = 0;
  std::optional<NmtState> nmt_;
  std::optional<Time> last_heartbeat_;
  Time expected_since_{};
  std::optional<std::chrono::milliseconds> within_;
  std::optional<Emergency> emergency_;
  bool over_ = false, was_told_ = false;
};

}  // namespace rig::drivers::cia402
