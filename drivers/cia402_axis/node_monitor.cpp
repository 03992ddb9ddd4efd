#include "drivers/cia402_axis/node_monitor.h"

namespace rig::drivers::cia402 {

namespace {

constexpr canid_t kEmergency = 0x080;
constexpr canid_t kHeartbeat = 0x700;

std::optional<NmtState> state_of(std::uint8_t byte) {
  switch (byte & 0x7FU) {
    case 0x04:
      return NmtState::stopped;
    case 0x05:
      return NmtState::operational;
    case 0x7F:
      return NmtState::pre_operational;
    default:
      return std::nullopt;
  }
}

}  // namespace

void NodeMonitor::hear(const can_frame& frame, Time now) {
  if (frame.can_id == kHeartbeat + node_ && frame.can_dlc == 1) {
    if (frame.data[0] == 0) {
      ++boots_;
      nmt_ = NmtState::pre_operational;  // which every node enters by itself
    } else if (const auto state = state_of(frame.data[0])) {
      nmt_ = state;
    } else {
      return;
    }
    last_heartbeat_ = expected_since_ = now;
    return;
  }
  if (frame.can_id == kEmergency + node_ && frame.can_dlc == 8) {
    const Emergency heard{static_cast<std::uint16_t>(frame.data[0] | frame.data[1] << 8U), frame.data[2]};
    if (heard.code >= 0x0100) {
      emergency_ = heard;
      over_ = was_told_ = false;
    } else if (was_told_) {
      emergency_.reset();
    } else {
      over_ = true;
    }
  }
}

void NodeMonitor::expect_heartbeats(Time now, std::chrono::milliseconds within) {
  within_ = within;
  expected_since_ = now;
}

void NodeMonitor::told() {
  was_told_ = true;
  if (over_) emergency_.reset();
}

}  // namespace rig::drivers::cia402
