// What rigd asks of a device. Every call is short: it starts, polls or reads, and returns; nothing waits for
// motion or light. Capabilities are asked for, never assumed. All calls of one device come from the one
// worker of its bus.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"

namespace rig::drivers {

using base::Result;

struct AxisCapabilities {
  double resolution_rad = 0;  ///< smallest commanded step
  double max_velocity_rad_s = 0;
  double max_acceleration_rad_s2 = 0;
  bool keeps_position_unpowered = false;  ///< an absolute encoder: homed survives a power cycle
  bool has_limit_switches = false;
  /// The fastest that home() moves; nothing where the driver cannot tell. rigd refuses one beyond the reduced
  /// speed.
  std::optional<double> homing_velocity_rad_s = std::nullopt;
};

struct AxisState {
  double position_rad = 0;  ///< readback
  bool enabled = false;     ///< drive energised
  bool moving = false;
  bool homed = false;
  bool at_low_limit = false, at_high_limit = false;
  std::string fault;                                   ///< empty: none
  std::optional<double> temperature_c = std::nullopt;  ///< of motor or drive, where it tells
};

class Axis {
 public:
  Axis() = default;
  Axis(const Axis&) = delete;
  Axis& operator=(const Axis&) = delete;
  virtual ~Axis() = default;

  [[nodiscard]] virtual AxisCapabilities capabilities() const = 0;
  /// Energises the drive or lets it go; `true` also acknowledges a fault whose cause is gone.
  [[nodiscard]] virtual Result<void> enable(bool on) = 0;
  /// Starts homing; it is done when state() says homed and not moving.
  [[nodiscard]] virtual Result<void> home() = 0;
  /// Starts an absolute move with at most this velocity and acceleration.
  [[nodiscard]] virtual Result<void> move_to(double target_rad, double velocity_rad_s,
                                             double acceleration_rad_s2) = 0;
  /// Starts a move by so much from where the axis stands, homed or not, with at most this velocity and
  /// acceleration: so that a person sees which way an axis turns before it is homed. It stays homed or not as
  /// it was, and position_rad changes by as much, whatever it is worth. Busy while the axis moves. Not asked
  /// twice where the answer is missing: what became of it is for state() to say.
  [[nodiscard]] virtual Result<void> move_by(double /*delta_rad*/, double /*velocity_rad_s*/,
                                             double /*acceleration_rad_s2*/) {
    return base::fail(base::ErrorCode::refused, "this axis cannot be moved before it is homed", {},
                      "home it; see its driver's page");
  }
  /// Starts to brake at once; clears what was planned.
  [[nodiscard]] virtual Result<void> stop() = 0;
  [[nodiscard]] virtual Result<AxisState> state() = 0;
};

struct CameraCapabilities {
  int width = 0, height = 0;
  int bits = 16;      ///< significant bits of a sample
  std::string bayer;  ///< "RGGB" ... or "none"
  double min_exposure_s = 0, max_exposure_s = 0;
  double readout_s = 0;          ///< from the end of exposure to a complete frame
  bool overlaps_motion = false;  ///< the rig may move during readout
};

struct FrameInfo {
  double exposure_s = 0;  ///< as the camera did it
  double gain = 1;
  base::Time started{};
  std::uint64_t counter = 0;  ///< the camera's own frame number
};

class Camera {
 public:
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;
  virtual ~Camera() = default;

  [[nodiscard]] virtual CameraCapabilities capabilities() const = 0;
  /// A new bracket begins; frames of an older one are dropped.
  [[nodiscard]] virtual Result<void> arm() = 0;
  /// Starts one exposure. Busy while an earlier one goes on, also one that was aborted and that the camera
  /// ends in its own time: rigd asks again, for as long as that one may take.
  [[nodiscard]] virtual Result<void> trigger(double exposure_s, double gain) = 0;
  /// Makes ready for one exposure, which the next pulse on the camera's trigger input begins. Refused by a
  /// camera that has none.
  [[nodiscard]] virtual Result<void> await_trigger(double /*exposure_s*/, double /*gain*/) {
    return base::fail(base::ErrorCode::refused, "this camera has no trigger input");
  }
  /// The frame of the last trigger into `pixels` (width * height); nothing yet while it exposes or reads out.
  /// ErrorCode::damaged: the exposure is over, and its frame is no good (incomplete, or another exposure's),
  /// while the camera itself is well and takes the next trigger. rigd takes the pose again.
  [[nodiscard]] virtual Result<std::optional<FrameInfo>> fetch(std::span<std::uint16_t> pixels) = 0;
  /// Ends an exposure; its frame never arrives.
  [[nodiscard]] virtual Result<void> abort() = 0;
  /// Of the sensor or housing; nothing from a camera that does not tell. Also asked while it exposes.
  [[nodiscard]] virtual Result<std::optional<double>> temperature_c() { return std::optional<double>(); }
};

struct LightCapabilities {
  bool has_shutter = false;
  bool has_level = false;  ///< else only 0 and 1
  double warm_up_s = 0;
};

struct LightState {
  bool on = false;
  bool shutter_open = false;
  double level = 0;  ///< 0 .. 1
  bool warm = false;
  double hours = 0;                                    ///< lamp life used
  std::string fault;                                   ///< empty: none
  std::optional<double> temperature_c = std::nullopt;  ///< of the lamp, where it tells
};

class Light {
 public:
  Light() = default;
  Light(const Light&) = delete;
  Light& operator=(const Light&) = delete;
  virtual ~Light() = default;

  [[nodiscard]] virtual LightCapabilities capabilities() const = 0;
  [[nodiscard]] virtual Result<void> set_level(double level) = 0;
  [[nodiscard]] virtual Result<void> set_shutter(bool open) = 0;
  [[nodiscard]] virtual Result<LightState> state() = 0;
};

struct Line {
  std::string name;  ///< "emergency_stop"
  bool output = false;
  /// Of an output: its state where nobody commands it, to which rigd-safe brings it; nothing: left as it is.
  std::optional<bool> at_rest = std::nullopt;
};

class DigitalIo {
 public:
  DigitalIo() = default;
  DigitalIo(const DigitalIo&) = delete;
  DigitalIo& operator=(const DigitalIo&) = delete;
  virtual ~DigitalIo() = default;

  [[nodiscard]] virtual std::vector<Line> lines() const = 0;
  /// Levels of all lines in the order of lines(): active is true, whatever the wiring. An input that was
  /// active at any moment since the last read counts as active, so that no press of a button falls between
  /// two looks; a line that cannot be read is an error, never a level.
  [[nodiscard]] virtual Result<std::vector<bool>> read() = 0;
  [[nodiscard]] virtual Result<void> set(const std::string& line, bool active) = 0;
};

/// A device that a module offers under a name, and the bus whose worker makes its calls. Buses of one name
/// within one module are one worker.
struct Device {
  std::string name;
  std::string bus;
  std::variant<std::unique_ptr<Axis>, std::unique_ptr<Camera>, std::unique_ptr<Light>,
               std::unique_ptr<DigitalIo>>
      is;
};

}  // namespace rig::drivers
