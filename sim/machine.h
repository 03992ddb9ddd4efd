// The moving parts, the lamp and the lines in time. All devices look at and change this one, under its lock.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "sim/faults.h"
#include "sim/press_watch.h"
#include "sim/size_limit.h"
#include "sim/state_file.h"
#include "sim/wire_log.h"
#include "sim/world.h"

namespace rig::sim {

/// What the camera looks at in one instant.
struct Scene {
  std::array<std::int64_t, kAxes> counts{};
  std::array<bool, kAxes> from_above{};
  Angles astray{};  ///< by how much lost steps and a fault's backlash move the axes from where they should be
  double light = 0;  ///< relative to the full level of a warm lamp; 0 behind the shutter
};

class Machine {
 public:
  /// Goes on from the state in `folder`, or begins with a new one there. Moves the clock on to the time the
  /// state ends at. Complaints about the file of faults go to `complain`.
  [[nodiscard]] static base::Result<std::shared_ptr<Machine>> open(const World& world, base::Clock& clock,
                                                                   const std::filesystem::path& folder,
                                                                   Faults::Complain complain);

  [[nodiscard]] const World& world() const { return world_; }
  [[nodiscard]] base::Clock& clock() const { return clock_; }

  /// Every call of a device passes here first: it may take its time, or find the device gone. Not called with
  /// the lock held, because it may wait in the clock.
  [[nodiscard]] base::Result<void> reach(const std::string& device);
  /// One occasion for a fault of a device; see Faults.
  [[nodiscard]] std::optional<double> strike(FaultKind kind, const std::string& device);

  [[nodiscard]] drivers::AxisState axis_state(std::size_t axis);
  [[nodiscard]] base::Result<void> enable(std::size_t axis, bool on);
  [[nodiscard]] base::Result<void> home(std::size_t axis);
  [[nodiscard]] base::Result<void> move(std::size_t axis, double target_rad, double velocity,
                                        double acceleration);
  /// By so much from where its counts say that it stands.
  [[nodiscard]] base::Result<void> jog(std::size_t axis, double by_rad, double velocity, double acceleration);
  [[nodiscard]] base::Result<void> stop(std::size_t axis);

  [[nodiscard]] drivers::LightState light_state();
  [[nodiscard]] base::Result<void> set_level(double level);
  void set_shutter(bool open);

  /// Active while a fault presses it, and while a file `emergency_stop` lies in the state folder: the drives
  /// have no power then. A press that began and ended since the last call counts.
  [[nodiscard]] bool emergency_stop();

  /// Of each axis the switches at its low and its high end that are wired to the lines. They see where the
  /// axis truly stands, lost steps included. What was pressed since the last call counts.
  [[nodiscard]] std::array<std::array<bool, 2>, kAxes> limit_lines();

  /// Who hears the rising edge of the camera's trigger line; empty: nobody.
  void on_trigger_line(std::function<void()> listener);
  void pulse_trigger_line();

  [[nodiscard]] Scene scene();

 private:
  /// With the lock held.
  [[nodiscard]] base::Result<void> set_off(std::size_t axis, double target_rad, double velocity,
                                           double acceleration);
  Machine(const World& world, base::Clock& clock, std::filesystem::path folder, StateFile file,
          Faults::Complain complain);
  [[nodiscard]] std::int64_t now_ns() const;
  /// Since the world was made.
  [[nodiscard]] double world_s() const;
  /// Where a move to a target ends: there, unless it stalls.
  [[nodiscard]] double reached_target(std::size_t axis, double target_rad);
  /// What the lamp gives now, shutter or not: its level, its warmth, its faults.
  [[nodiscard]] double light_output(const Scene& scene);
  [[nodiscard]] bool button_pressed() const;
  /// Brings the memory up to the present: power cut by the button, homing that has ended.
  void catch_up();
  /// Which of an axis' switches at the lines it presses now.
  [[nodiscard]] std::array<bool, 2> pressed_switches(std::size_t axis) const;
  /// Before an axis is sent elsewhere: what it presses here counts at the next reading.
  void note_switches(std::size_t axis);
  /// A fault's: the clock forward now, or the machine's back, which the next process finds.
  void step_clock(double by_s);
  void fill_disk();
  void save();

  std::mutex trigger_mutex_;
  std::function<void()> on_trigger_;
  std::mutex mutex_;
  const World world_;
  base::Clock& clock_;
  std::filesystem::path folder_;
  StateFile file_;
  Memory memory_;
  Faults faults_;
  PressWatch button_;
  bool press_unread_ = false;                                 // by emergency_stop()
  std::array<std::array<bool, 2>, kAxes> switches_unread_{};  // by limit_lines()
  std::optional<WireLog> wire_log_;
  std::array<bool, kAxes> stalled_{};  // pushes and does not move
  std::int64_t pressed_until_ns_ = 0;  // the button, by a fault
  bool lamp_failed_ = false;
  std::optional<SizeLimit> disk_full_;
  std::int64_t disk_full_until_ns_ = 0;
  std::int64_t set_back_ns_ = 0;  // the machine's clock, since this process began
};

}  // namespace rig::sim
