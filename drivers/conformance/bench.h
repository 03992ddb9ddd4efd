// What the conformance suite needs of a test bench: the module under test, and the device at the other end of
// its wire, which somebody else wrote or which was written from the protocol, not from the driver.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/conformance/task.h"

namespace rig::drivers::conformance {

/// How the next answers of the device are spoilt on their way.
enum class Spoil {
  missing,    ///< they never come
  garbage,    ///< other bytes come in their place
  late,       ///< they come after the driver's deadline, into the next transaction
  duplicate,  ///< they come twice
};

/// The wire, as something that breaks. Each function answers false where this bench cannot do that: the check
/// is then "not proven" in the table, never passed.
class Wire {
 public:
  Wire() = default;
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;
  virtual ~Wire() = default;
  /// The device is gone, as when its plug is pulled, until restore().
  virtual bool cut() { return false; }
  virtual bool restore() { return false; }
  virtual bool spoil(Spoil /*how*/, int /*answers*/) { return false; }
  /// Of the next so many answers only each third comes; 0: all come again.
  virtual bool thin_out(int /*answers*/) { return false; }
};

/// The device at the other end of an axis, asked beside the driver.
class AxisPeer {
 public:
  AxisPeer() = default;
  AxisPeer(const AxisPeer&) = delete;
  AxisPeer& operator=(const AxisPeer&) = delete;
  virtual ~AxisPeer() = default;
  [[nodiscard]] virtual double position_rad() = 0;  ///< in the axis' own terms
  [[nodiscard]] virtual bool moving() = 0;
  /// Commands to stop that have arrived on the wire so far.
  [[nodiscard]] virtual int stops_seen() = 0;
  /// Presses or lets go the limit switch on that side of positive angles.
  virtual bool set_limit(bool /*high*/, bool /*active*/) { return false; }
  /// The drive's own fault (overload, say), whose cause lasts until it is taken back.
  virtual bool set_fault(bool /*on*/) { return false; }
  /// False: such a device reports no fault of its own, by its protocol.
  [[nodiscard]] virtual bool reports_faults() { return true; }
  /// As after a power cycle: the device does not know where it stands.
  virtual bool forget_reference() { return false; }
};

struct AxisUnderTest {
  std::string device;
  AxisPeer* peer = nullptr;
  /// Within these the suite moves; the device's own travel is wider by at least 5 degrees on each side.
  double low_rad = 0, high_rad = 0;
  double velocity_rad_s = 0, acceleration_rad_s2 = 0;  ///< a move from low to high takes 0.5 to 3 s
  std::chrono::milliseconds stop_bound{};              ///< from the call to the command on the wire
};

class CameraPeer {
 public:
  CameraPeer() = default;
  CameraPeer(const CameraPeer&) = delete;
  CameraPeer& operator=(const CameraPeer&) = delete;
  virtual ~CameraPeer() = default;
  /// The exposure that the pixels themselves prove; nothing where the device paints none into them.
  [[nodiscard]] virtual std::optional<double> exposure_in(std::span<const std::uint16_t> /*pixels*/) {
    return std::nullopt;
  }
  /// The next frame arrives damaged, or not at all.
  virtual bool corrupt_next() { return false; }
  virtual bool drop_next() { return false; }
};

struct CameraUnderTest {
  std::string device;
  CameraPeer* peer = nullptr;
  std::vector<double> exposures_s;  ///< eight different ones, for the bracket
  double gain = 1;
  double tolerance = 0.02;                       ///< of exposures, relative
  std::chrono::milliseconds frame_within{2000};  ///< beyond the exposure
};

class LightPeer {
 public:
  LightPeer() = default;
  LightPeer(const LightPeer&) = delete;
  LightPeer& operator=(const LightPeer&) = delete;
  virtual ~LightPeer() = default;
  [[nodiscard]] virtual double level() = 0;  ///< that shines: 0 behind a closed shutter
};

struct LightUnderTest {
  std::string device;
  LightPeer* peer = nullptr;
};

class LinesPeer {
 public:
  LinesPeer() = default;
  LinesPeer(const LinesPeer&) = delete;
  LinesPeer& operator=(const LinesPeer&) = delete;
  virtual ~LinesPeer() = default;
  virtual void set_input(const std::string& line, bool active) = 0;
  [[nodiscard]] virtual bool output(const std::string& line) = 0;
};

struct LinesUnderTest {
  std::string device;
  LinesPeer* peer = nullptr;
  std::string input, output;                   ///< names of one of each; empty: none
  bool output_at_rest = false;                 ///< its defined state on start, exit and loss
  std::chrono::milliseconds seen_within{500};  ///< an input's change
};

/// A module at work where it can be killed. Killed with this object at the latest.
class Victim {
 public:
  Victim() = default;
  Victim(const Victim&) = delete;
  Victim& operator=(const Victim&) = delete;
  virtual ~Victim() = default;
  /// It runs nothing more, no destructor either. Returns when it is gone.
  virtual void kill() = 0;
};

/// One module on its bench. The suite opens and closes the module as often as it likes, one opening at a
/// time.
class Bench {
 public:
  Bench() = default;
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  virtual ~Bench() = default;

  [[nodiscard]] virtual std::string name() const = 0;  ///< "ptu_axis"
  /// The module's devices, freshly opened on the same device as before (open_module() of
  /// module_under_test.h). What the module holds ends with them.
  [[nodiscard]] virtual base::Result<std::vector<Device>> open() = 0;
  [[nodiscard]] virtual base::Clock& clock() = 0;
  /// The device is as after power-up: at rest in the middle, no faults, no limits, not referenced, the wire
  /// whole. Called before each check.
  virtual void reset() = 0;
  [[nodiscard]] virtual Wire& wire() = 0;
  /// The module, not open here, doing a task in a process of its own (start_victim() of module_under_test.h).
  /// nullptr where no device would outlive that process: it lives in the module.
  [[nodiscard]] virtual base::Result<std::unique_ptr<Victim>> start_victim(const Task& /*task*/) {
    return nullptr;
  }

  [[nodiscard]] virtual std::optional<AxisUnderTest> axis() { return std::nullopt; }
  [[nodiscard]] virtual std::optional<CameraUnderTest> camera() { return std::nullopt; }
  [[nodiscard]] virtual std::optional<LightUnderTest> light() { return std::nullopt; }
  [[nodiscard]] virtual std::optional<LinesUnderTest> lines() { return std::nullopt; }
};

}  // namespace rig::drivers::conformance
