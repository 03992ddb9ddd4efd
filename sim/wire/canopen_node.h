// A CANopen drive on its bus (CiA 301 and 402): NMT, heartbeat, SDO server, emergency object, and the first
// receive PDO, around a drive that turns. Strict: what is wrong is answered as a real one would, or not at
// all.
#pragma once

#include <deque>
#include <linux/can.h>
#include <optional>
#include <string>
#include <vector>

#include "sim/wire/canopen_dictionary.h"
#include "sim/wire/canopen_sdo_server.h"
#include "sim/wire/cia402_drive.h"

namespace rig::sim::wire {

/// Not for several threads: CanopenStation guards it. Times are given.
class CanopenNode {
 public:
  using Time = Cia402Drive::Time;
  using milliseconds = std::chrono::milliseconds;

  struct Settings {
    int id = 1;
    Cia402Drive::Settings drive;
    std::string name = "rigd simulated drive";
    milliseconds answer_after{1};  ///< that its server takes
    milliseconds boot{30};         ///< from power to its boot-up message
    bool maps_controlword = true;  ///< the first PDO carries the controlword by itself
    bool maps_freely = true;       ///< or can be made to
    bool has_heartbeat = true;     ///< object 1017
  };

  /// It has no power yet.
  explicit CanopenNode(const Settings& settings);
  CanopenNode(const CanopenNode&) = delete;
  CanopenNode& operator=(const CanopenNode&) = delete;

  void power_on(Time now);
  void power_off(Time now);
  [[nodiscard]] bool is_up() const { return phase_ == Phase::up; }

  void receive(Time now, const can_frame& frame);
  /// A cycle, of a millisecond or so; the frames that are due.
  [[nodiscard]] std::vector<can_frame> tick(Time now);

  [[nodiscard]] Cia402Drive& drive() { return drive_; }
  [[nodiscard]] const Settings& settings() const { return settings_; }

  /// An emergency object of the test's own; with a code it goes into the error history too.
  void emergency(std::uint16_t code, std::uint8_t error_register);
  /// No heartbeats, as when it hangs.
  void mute_heartbeat(bool mute) { is_muted_ = mute; }
  /// Its server answers nothing, while it goes on to take PDOs and to live.
  void silence_server(bool silent) { is_silent_ = silent; }
  /// Writes one of its objects as its maker's own tool would.
  void put(std::uint16_t index, std::uint8_t sub, std::uint32_t value) { objects_.put(index, sub, value); }
  [[nodiscard]] std::uint32_t value(std::uint16_t index, std::uint8_t sub = 0) const {
    return objects_.value(index, sub);
  }
  /// As the NMT master's commands.
  void nmt(Time now, std::uint8_t command);
  /// 4 stopped, 5 operational, 127 pre-operational.
  [[nodiscard]] std::uint8_t nmt_state() const { return nmt_; }

 private:
  enum class Phase { off, booting, up };
  struct Due {
    can_frame frame;
    Time at;
  };

  void add_objects();
  void boot(Time now);
  void enter(std::uint8_t state);
  void send(canid_t id, std::vector<std::uint8_t> bytes, Time at);
  void take_pdo(const can_frame& frame);
  [[nodiscard]] std::uint32_t map_pdo(std::uint8_t sub, std::uint32_t value);

  const Settings settings_;
  CanopenDictionary objects_;
  Cia402Drive drive_;
  CanopenSdoServer server_;
  Time now_{};
  Phase phase_ = Phase::off;
  Time up_at_{};
  std::uint8_t nmt_ = 0;
  std::optional<Time> next_heartbeat_;
  bool is_muted_ = false, is_silent_ = false;
  std::uint8_t error_register_ = 0;
  std::deque<std::uint32_t> history_;
  std::deque<Due> due_;
};

}  // namespace rig::sim::wire
