// One drive of CiA 402 on the bus: set up, spoken to object by object, met anew after every loss.
#pragma once

#include <cstring>
#include <optional>

#include "drivers/cia402_axis/network.h"
#include "drivers/cia402_axis/statusword.h"

namespace rig::drivers::cia402 {

/// The objects that this driver uses.
namespace object {
inline constexpr Object kDeviceType{0x1000, 0}, kName{0x1008, 0}, kHeartbeatTime{0x1017, 0};
inline constexpr Object kPdoId{0x1400, 1}, kPdoKind{0x1400, 2};
inline constexpr Object kPdoMappedCount{0x1600, 0}, kPdoMapped{0x1600, 1};
inline constexpr Object kErrorCode{0x603F, 0}, kControlword{0x6040, 0}, kStatusword{0x6041, 0};
inline constexpr Object kQuickStopOption{0x605A, 0}, kMode{0x6060, 0}, kModeShown{0x6061, 0};
inline constexpr Object kPosition{0x6064, 0}, kTargetPosition{0x607A, 0}, kHomeOffset{0x607C, 0};
inline constexpr Object kProfileVelocity{0x6081, 0}, kAcceleration{0x6083, 0}, kDeceleration{0x6084, 0};
inline constexpr Object kQuickStopDeceleration{0x6085, 0};
inline constexpr Object kHomingMethod{0x6098, 0}, kHomingSpeed{0x6099, 1}, kHomingCreep{0x6099, 2};
inline constexpr Object kHomingAcceleration{0x609A, 0}, kDigitalInputs{0x60FD, 0};
inline constexpr Object kSupportedModes{0x6502, 0};
}  // namespace object

/// Functions with a deadline return by then; their errors are the Network's.
class Drive {
 public:
  Drive(std::shared_ptr<Network> network, const DriveSettings& settings, Network::Log log);

  /// Hears what the bus has brought; makes the drive's acquaintance where it is new, booted or was lost.
  /// Between two tries to find a drive that is gone the answer is `lost` at once.
  [[nodiscard]] base::Result<void> reach(Steady::time_point deadline);
  /// Grows whenever the drive was met anew: what was believed of it is void.
  [[nodiscard]] int acquaintance() const { return acquaintance_; }
  /// False where it has booted, or the bus was away, since reach(): what was read is of nobody known.
  [[nodiscard]] bool is_the_same() {
    return is_met_ && network_->generation() == generation_ && monitor().boots() == boots_;
  }

  template <typename T>
  [[nodiscard]] base::Result<T> read(Object object, Steady::time_point deadline) {
    auto bytes = read_bytes(object, deadline, sizeof(T));
    if (!bytes) return base::pass(bytes);
    T value{};
    std::memcpy(&value, bytes->data(), sizeof value);  // the wire has the order of this machine
    return value;
  }
  template <typename T>
  [[nodiscard]] base::Result<void> write(Object object, T value, Steady::time_point deadline) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof value);
    return noting_loss(network_->download(settings_.node, object, {bytes, sizeof bytes}, deadline));
  }

  [[nodiscard]] base::Result<std::uint16_t> statusword(Steady::time_point deadline) {
    return read<std::uint16_t>(object::kStatusword, deadline);
  }
  [[nodiscard]] base::Result<void> control(std::uint16_t controlword, Steady::time_point deadline) {
    return write(object::kControlword, controlword, deadline);
  }

  /// The mode that the drive shows, as read when it was met and after set_mode.
  [[nodiscard]] std::int8_t mode() const { return mode_; }
  /// False where the drive does not show the mode within a short time.
  [[nodiscard]] base::Result<bool> set_mode(std::int8_t mode, Steady::time_point deadline);

  /// The quick stop's controlword, to any drive in any state, known or not: as a PDO where the drive takes
  /// its controlword so, which needs no answer and passes by what its server is busy with, and in any case as
  /// an SDO, whose answer is the proof.
  [[nodiscard]] base::Result<void> quick_stop(Steady::time_point deadline);
  /// Whether the drive holds its motor after a quick stop (option codes 5 to 8).
  [[nodiscard]] bool stays_in_quick_stop() const { return stays_in_quick_stop_; }

  [[nodiscard]] NodeMonitor& monitor() { return network_->monitor(settings_.node); }
  [[nodiscard]] std::string where() const { return network_->where(settings_.node); }
  [[nodiscard]] const DriveSettings& settings() const { return settings_; }
  [[nodiscard]] std::chrono::milliseconds call_bound() const { return network_->settings().retry.call; }

 private:
  [[nodiscard]] base::Result<std::string> read_bytes(Object object, Steady::time_point deadline,
                                                     std::size_t at_least);
  template <typename T>
  [[nodiscard]] base::Result<T> noting_loss(base::Result<T> result) {
    // One that has answered just now and did not come to an end within the call is slow, not gone.
    if (!result && result.error().code == base::ErrorCode::lost &&
        !network_->has_answered_lately(settings_.node)) {
      lose(result.error());
    }
    return result;
  }
  void lose(const base::Error& error);
  [[nodiscard]] base::Result<void> stay_acquainted(Steady::time_point deadline);
  /// Goes on where the call before ran out of time: a drive that answers slowly is met in several calls.
  [[nodiscard]] base::Result<void> meet(Steady::time_point deadline);
  [[nodiscard]] base::Result<void> check_kind(Steady::time_point deadline);
  [[nodiscard]] base::Result<void> set_up_quick_stop(Steady::time_point deadline);
  [[nodiscard]] base::Result<void> set_up_heartbeat(Steady::time_point deadline);
  [[nodiscard]] base::Result<void> find_pdo(Steady::time_point deadline);
  [[nodiscard]] base::Result<void> start_and_read_mode(Steady::time_point deadline);
  [[nodiscard]] base::Result<void> require_heartbeat(Steady::time_point deadline);
  [[nodiscard]] base::Result<bool> map_pdo(Steady::time_point deadline);

  const std::shared_ptr<Network> network_;
  const DriveSettings settings_;
  const Network::Log log_;

  bool is_met_ = false;
  std::size_t steps_done_ = 0;  // of meeting it
  Steady::time_point meeting_since_{};
  bool is_mute_ = false;  // its heartbeat was missed
  int acquaintance_ = 0;
  int generation_ = 0, boots_ = 0;   // of the network and the node, when it was met
  std::optional<base::Error> lost_;  // why it is gone
  Steady::time_point lost_at_{};
  std::optional<canid_t> pdo_;  // that carries the controlword alone
  bool stays_in_quick_stop_ = false;
  std::int8_t mode_ = 0;
};

}  // namespace rig::drivers::cia402
