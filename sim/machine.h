// The virtual rig as a machine in time: all devices look at and change this one, under its lock.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "sim/renderer.h"
#include "sim/state_file.h"
#include "sim/world.h"

namespace rig::sim {

class Machine {
 public:
  /// Moves the clock on to the time the state file ends at.
  [[nodiscard]] static base::Result<std::shared_ptr<Machine>> open(const World& world, base::Clock& clock,
                                                                   const std::filesystem::path& folder);

  [[nodiscard]] const World& world() const { return world_; }

  [[nodiscard]] drivers::AxisState axis_state(std::size_t axis);
  [[nodiscard]] base::Result<void> enable(std::size_t axis, bool on);
  [[nodiscard]] base::Result<void> home(std::size_t axis);
  [[nodiscard]] base::Result<void> move(std::size_t axis, double target_rad, double velocity,
                                        double acceleration);
  [[nodiscard]] base::Result<void> stop(std::size_t axis);

  [[nodiscard]] drivers::LightState light_state();
  void set_level(double level);
  void set_shutter(bool open);

  /// Active while a file `emergency_stop` lies in the state folder: the drives have no power then.
  [[nodiscard]] bool emergency_stop();

  void arm();
  [[nodiscard]] base::Result<void> trigger(double exposure_s, double gain);
  [[nodiscard]] base::Result<std::optional<drivers::FrameInfo>> fetch(std::span<std::uint16_t> pixels);
  void abort();

 private:
  struct Exposure {
    base::Time started;
    double exposure_s, gain;
    std::uint64_t nth;  ///< how often this setting was taken since the bracket was armed
    std::array<std::int64_t, kAxes> counts;
    std::array<bool, kAxes> from_above;
    double level;
  };

  Machine(const World& world, base::Clock& clock, std::filesystem::path folder, StateFile file);
  void cut_power_if_stopped();
  void halt(AxisMemory& axis, std::size_t index, bool braking);
  void save();
  [[nodiscard]] double position(const AxisMemory& axis, std::size_t index) const;
  [[nodiscard]] bool moving(const AxisMemory& axis, std::size_t index) const;
  void start_move(std::size_t index, double target_rad, double velocity, double acceleration);
  void finish_homing();
  [[nodiscard]] double light_now() const;

  std::mutex mutex_;
  const World world_;
  base::Clock& clock_;
  std::filesystem::path folder_;
  StateFile file_;
  Memory memory_;
  Renderer renderer_;

  std::optional<Exposure> exposure_;
  std::map<std::pair<double, double>, std::uint64_t> taken_;  // exposure and gain, since armed
  std::uint64_t counter_ = 0;
  std::string rendered_key_;
  std::vector<float> rendered_;
};

}  // namespace rig::sim
