// A pan-tilt unit on one connection. What is believed of it ends with the connection.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "drivers/api/device.h"
#include "drivers/common/steps.h"
#include "drivers/ptu_axis/link.h"
#include "drivers/ptu_axis/settings.h"

namespace rig::drivers::ptu {

/// Every call is short. What takes longer (being set up, a reset, a new acceleration) goes on in steps, some
/// at each call; meanwhile the unit hears nothing else, so that nothing else is asked.
class Session {
 public:
  /// `resolutions`: the counts per radian that each axis had on earlier connections; another is an error.
  Session(const Settings& settings, std::vector<std::optional<double>>& resolutions, Link link,
          base::Clock& clock);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// All that follows belongs to a call that has to be over by then.
  void begin_call(Deadline ends) { link_.begin_call(ends); }
  /// Goes on with being set up. True: it is. An error is the end of the session.
  [[nodiscard]] base::Result<bool> set_up() { return progress(); }
  [[nodiscard]] bool is_set_up() const { return phase_ != Phase::setting_up; }
  /// Tells the unit to halt and waits for nothing; for one that is not set up.
  [[nodiscard]] base::Result<void> shout_halt();

  /// The following ones are for a unit that is set up.
  [[nodiscard]] AxisCapabilities capabilities(std::size_t axis) const;
  [[nodiscard]] base::Result<void> enable(std::size_t axis, bool on);
  [[nodiscard]] base::Result<void> home(std::size_t axis);
  [[nodiscard]] base::Result<void> move_to(std::size_t axis, double target_rad, double velocity_rad_s,
                                           double acceleration_rad_s2);
  [[nodiscard]] base::Result<void> move_by(std::size_t axis, double delta_rad, double velocity_rad_s,
                                           double acceleration_rad_s2);
  [[nodiscard]] base::Result<void> stop(std::size_t axis);
  [[nodiscard]] base::Result<AxisState> state(std::size_t axis);

 private:
  enum class Phase { setting_up, ready, resetting, tabling };
  enum class Motion {
    rest,
    going,    ///< to its target
    unknown,  ///< at rest where it stands at its target
    halting,  ///< or otherwise moving, for all that is known: until it is seen to stand
  };
  struct Seen {
    base::Time since;
    int position;
  };
  struct Plan {
    int target, speed;
  };
  struct Axis {
    UnitAxis settings;
    int low = 0, high = 0;  ///< of travel; equal: not known
    int slowest = 0, fastest = 0, acceleration = 0;
    bool enabled = false;
    bool homed = false;
    bool along = false;  ///< homed by the reset of the other axis, and not asked for or moved since
    bool at_low = false, at_high = false;
    std::string fault;
    Motion motion = Motion::unknown;
    int position = 0, desired = 0;  ///< as the unit told last
    int target = 0, direction = 0;
    std::optional<Seen> seen;
    std::optional<Plan> plan;  ///< once the acceleration is set
  };

  // set_up.cpp
  void plan_set_up();
  void add_order(std::string command);
  void add_number(std::string query, std::function<base::Result<void>(double)> take);
  void add_awaited(const std::string& command, std::chrono::milliseconds within);
  void add_tabled(const std::string& command);
  void add_rest();
  void add_limits(Axis& axis);
  void add_base(Axis& axis, int is);
  void add_acceleration(Axis& axis, int wanted);
  [[nodiscard]] base::Result<void> take_resolution(std::size_t axis, double arcsec);
  [[nodiscard]] base::Result<Steps::Is> ask_resolution(std::size_t axis);

  // session.cpp
  /// Goes on with what is under way. True: nothing is.
  [[nodiscard]] base::Result<bool> progress();
  [[nodiscard]] base::Result<void> ready_for(const Axis& axis, std::string_view what);
  [[nodiscard]] base::Result<void> look(Axis& axis);
  static void doubt(Axis& axis, Motion as);
  [[nodiscard]] base::Result<bool> all_at_rest();
  void hit_end_stop(Axis& axis);
  void end_reset(const std::vector<std::size_t>& axes, bool homed);
  [[nodiscard]] base::Result<std::optional<double>> temperature();
  [[nodiscard]] std::string axis_command(const Axis& axis, std::string_view what) const;
  [[nodiscard]] AxisState believed(const Axis& axis, bool moving) const;

  // moves.cpp
  [[nodiscard]] tl::unexpected<base::Error> refused(const Axis& axis, const std::string& why,
                                                    std::string hint) const;
  [[nodiscard]] base::Result<void> check_rates(const Axis& axis, double velocity, double acceleration) const;
  [[nodiscard]] base::Result<void> may_set_off(const Axis& axis);
  [[nodiscard]] base::Result<void> start(std::size_t axis, int target, double velocity, double acceleration);
  [[nodiscard]] base::Result<void> go(Axis& axis, Plan plan);
  /// The unit keeps its limits of travel, also after a jog.
  [[nodiscard]] base::Result<void> keep_limits_again();

  const Settings& settings_;
  std::vector<std::optional<double>>& resolutions_;
  Link link_;
  base::Clock& clock_;
  std::vector<Axis> axes_;
  Steps steps_;
  Phase phase_ = Phase::setting_up;
  std::vector<std::size_t> busy_;  ///< axes that a reset or a new acceleration is for
  bool stopped_ = false;           ///< what is under way was stopped
  bool limits_are_off_ = false;    ///< for a jog of an axis that was not reset
  base::Time awaited_until_{};
  std::string marker_, last_resolution_;
  int resolutions_asked_ = 0;
  bool tells_temperature_ = true;
  std::optional<double> temperature_c_;
  base::Time temperature_at_{};
};

}  // namespace rig::drivers::ptu
