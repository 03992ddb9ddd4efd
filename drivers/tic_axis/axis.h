// One axis whose motor a Pololu Tic turns.
//
// Open loop: the Tic counts the steps that it makes, and says itself when the count may be wrong (its flag
// "position uncertain"). Homed is that flag's contrary; nothing is remembered here. Position moves and stops
// are the Tic's own; between calls only the feeding of its command timeout goes on (feeder.h).
#pragma once

#include "drivers/api/device.h"
#include "drivers/api/module.h"
#include "drivers/common/connection.h"
#include "drivers/tic_axis/session.h"

namespace rig::drivers::tic {

class TicAxis final : public Axis {
 public:
  /// Looks for the Tic at once; where it is not there, with the calls that follow.
  TicAxis(TicSettings tic, ModuleSettings module, base::Clock& clock, Session::Log log);

  /// Limit switches as the Tic's settings have them; none before it was there for the first time.
  [[nodiscard]] AxisCapabilities capabilities() const override;
  /// On: clears a driver's error, forgets a target of before, energises and leaves safe start; waits for the
  /// Tic to start up, which takes 10 ms. What keeps it from that is a `device` error. Off: the coils are
  /// without current, and the reference is gone.
  [[nodiscard]] base::Result<void> enable(bool on) override;
  [[nodiscard]] base::Result<void> home() override;
  [[nodiscard]] base::Result<void> move_to(double target_rad, double velocity_rad_s,
                                           double acceleration_rad_s2) override;
  /// A target in the Tic's own counting, which it follows also while its position is uncertain.
  [[nodiscard]] base::Result<void> move_by(double delta_rad, double velocity_rad_s,
                                           double acceleration_rad_s2) override;
  /// Brakes in any case; with Stop::halt a motor that turns is then halted at once. One that does not obey is
  /// de-energised.
  [[nodiscard]] base::Result<void> stop() override;
  [[nodiscard]] base::Result<AxisState> state() override;

 private:
  struct Errand {
    std::optional<std::int32_t> target;  ///< counts; nothing: home
    [[nodiscard]] bool done(const Variables& now) const;
  };

  /// `use` with a session, as a call of rigd's: its time begins here.
  enum class Call { usual, stop };
  template <typename Use>
  auto with(Use&& use, Call call = Call::usual) -> decltype(use(std::declval<Session&>()));
  /// The errors that have occurred are known now; those to come will be told of.
  [[nodiscard]] base::Result<void> acknowledge(Link& link, const Variables& now);
  [[nodiscard]] base::Result<void> halt(Link& link);
  [[nodiscard]] base::Result<void> let_go(Link& link);
  [[nodiscard]] base::Result<void> go_home(Session& session, const Variables& found);
  /// The Tic as it is, where it can be given a target.
  [[nodiscard]] base::Result<Variables> ready_for_target(Session& session);
  [[nodiscard]] base::Result<void> go(Link& link, const Variables& now, std::int32_t target,
                                      std::uint32_t speed, std::uint32_t accel);
  [[nodiscard]] base::Result<void> set_here(Session& session, const Variables& now);
  [[nodiscard]] base::Result<void> send_rates(Link& link, const Variables& now, std::uint32_t speed,
                                              std::uint32_t accel);
  [[nodiscard]] std::string fault_of(const Session& session, const Variables& now);

  const TicSettings tic_;
  const ModuleSettings module_;
  const Session::Log log_;
  Heartbeat heart_;
  Deadline call_ends_{};
  Connection<Session> connection_;
  bool has_switches_ = false;
  std::optional<double> homing_velocity_rad_s_;  ///< of the Tic's own homing, as its settings have it
  // What was last set going and is not known to have ended.
  std::optional<Errand> errand_;
  // Errors that occurred and are over, told until the next command.
  std::uint32_t untold_ = 0;
};

}  // namespace rig::drivers::tic
