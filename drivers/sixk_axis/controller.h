// A 6000 controller on one connection.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "drivers/api/device.h"
#include "drivers/common/steps.h"
#include "drivers/sixk_axis/link.h"
#include "drivers/sixk_axis/reference.h"
#include "drivers/sixk_axis/settings.h"

namespace rig::drivers::sixk {

/// Every call is short. Being set up goes on in steps, some at each call.
class Controller {
 public:
  /// `references` has one of each axis and outlives it.
  Controller(const Settings& settings, std::vector<Reference>& references, Link link, base::Clock& clock);
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// All that follows belongs to a call that has to be over by then.
  void begin_call(Deadline ends) { link_.begin_call(ends); }
  /// Goes on with being set up. True: it is. An error is the end of this connection.
  [[nodiscard]] base::Result<bool> set_up();
  [[nodiscard]] bool is_set_up() const { return set_up_; }
  /// Tells an axis to stop and waits for nothing; for a controller that is not set up.
  [[nodiscard]] base::Result<void> shout_stop(std::size_t axis);

  [[nodiscard]] AxisCapabilities capabilities(std::size_t axis) const;
  /// The following ones are for a controller that is set up.
  [[nodiscard]] base::Result<void> enable(std::size_t axis, bool on);
  [[nodiscard]] base::Result<void> home(std::size_t axis);
  [[nodiscard]] base::Result<void> move_to(std::size_t axis, double target_rad, double velocity_rad_s,
                                           double acceleration_rad_s2);
  [[nodiscard]] base::Result<void> move_by(std::size_t axis, double delta_rad, double velocity_rad_s,
                                           double acceleration_rad_s2);
  [[nodiscard]] base::Result<void> stop(std::size_t axis);
  [[nodiscard]] base::Result<AxisState> state(std::size_t axis);

 private:
  struct Sent {
    base::Time at;
    std::int32_t target;
  };
  struct Axis {
    ControllerAxis settings;
    double counts_per_turn = 0;
    bool shows_mode = false;           ///< its status says that it is in absolute mode
    std::optional<Sent> sent;          ///< the last GO, until its status shows it
    std::optional<base::Time> homing;  ///< since when
    std::string fault;                 ///< beyond what its status says
  };

  struct Rates {
    std::string velocity, acceleration;  ///< as the controller takes them
  };

  void plan_set_up();
  void add_order(int axis, std::string command, bool needed);
  [[nodiscard]] base::Result<Steps::Is> ask_revision();
  [[nodiscard]] base::Result<Steps::Is> ask_resolution(Axis& axis);
  [[nodiscard]] std::string mask(const Axis& axis, char others, char own) const;
  /// A rate of the axis in turns of its motor, as the controller takes it: rounded down to its last digit.
  [[nodiscard]] base::Result<std::string> turns(const Axis& axis, double rad_per_s,
                                                std::string_view what) const;
  [[nodiscard]] base::Result<Rates> rates(const Axis& axis, double velocity, double acceleration) const;
  [[nodiscard]] tl::unexpected<base::Error> refused(const Axis& axis, const std::string& why,
                                                    std::string hint) const;
  /// The axis as it is, where it can be sent somewhere: energised, without a fault, not homing.
  [[nodiscard]] base::Result<Status> ready_to_go(std::size_t axis);
  [[nodiscard]] base::Result<void> go(Axis& axis, const Status& now, std::int32_t target, const Rates& rates);
  [[nodiscard]] base::Result<Status> status(std::size_t axis);
  [[nodiscard]] base::Result<std::int32_t> read_position(const Axis& axis);
  [[nodiscard]] base::Result<bool> look_after_homing(std::size_t axis, const Status& status);
  [[nodiscard]] std::string stop_command(const Axis& axis) const;

  const Settings& settings_;
  std::vector<Reference>& references_;
  Link link_;
  base::Clock& clock_;
  std::vector<Axis> axes_;
  Steps steps_;
  bool set_up_ = false;
  std::string revision_;
  int revisions_asked_ = 0;
};

}  // namespace rig::drivers::sixk
