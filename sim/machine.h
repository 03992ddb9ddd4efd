// The moving parts, the lamp and the lines in time. All devices look at and change this one, under its lock.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "sim/state_file.h"
#include "sim/world.h"

namespace rig::sim {

/// What the camera looks at in one instant.
struct Scene {
  std::array<std::int64_t, kAxes> counts{};
  std::array<bool, kAxes> from_above{};
  double light = 0;  ///< relative to the full level of a warm lamp; 0 behind the shutter
};

class Machine {
 public:
  /// Goes on from the state in `folder`, or begins with a new one there. Moves the clock on to the time the
  /// state ends at.
  [[nodiscard]] static base::Result<std::shared_ptr<Machine>> open(const World& world, base::Clock& clock,
                                                                   const std::filesystem::path& folder);

  [[nodiscard]] const World& world() const { return world_; }
  [[nodiscard]] base::Clock& clock() const { return clock_; }

  [[nodiscard]] drivers::AxisState axis_state(std::size_t axis);
  [[nodiscard]] base::Result<void> enable(std::size_t axis, bool on);
  [[nodiscard]] base::Result<void> home(std::size_t axis);
  [[nodiscard]] base::Result<void> move(std::size_t axis, double target_rad, double velocity,
                                        double acceleration);
  [[nodiscard]] base::Result<void> stop(std::size_t axis);

  [[nodiscard]] drivers::LightState light_state();
  [[nodiscard]] base::Result<void> set_level(double level);
  void set_shutter(bool open);

  /// Active while a file `emergency_stop` lies in the state folder: the drives have no power then.
  [[nodiscard]] bool emergency_stop();

  [[nodiscard]] Scene scene();

 private:
  Machine(const World& world, base::Clock& clock, std::filesystem::path folder, StateFile file);
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] bool button_pressed() const;
  /// Brings the memory up to the present: power cut by the button, homing that has ended.
  void catch_up();
  void save();

  std::mutex mutex_;
  const World world_;
  base::Clock& clock_;
  std::filesystem::path folder_;
  StateFile file_;
  Memory memory_;
};

}  // namespace rig::sim
