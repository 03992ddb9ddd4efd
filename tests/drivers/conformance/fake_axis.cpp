#include "tests/drivers/conformance/fake_axis.h"

#include <cmath>
#include <optional>

#include "drivers/common/counts.h"
#include "tests/drivers/conformance/fake_drive.h"

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

class FakeAxis final : public Axis {
 public:
  FakeAxis(FakeWire& wire, base::Clock& clock, FakeMemory& memory, Flaw flaw)
      : clock_(clock), memory_(memory), flaw_(flaw), line_(wire, clock, flaw) {
    if (flaw_ == Flaw::moves_at_opening) (void)order({kAxisMove, 0, 4000, 40000});
  }

  [[nodiscard]] AxisCapabilities capabilities() const override {
    return {flaw_ == Flaw::finer_than_true ? 0.1 * FakeDrive::kStep_rad : FakeDrive::kStep_rad, 2, 8, false,
            true};
  }

  [[nodiscard]] Result<void> enable(bool on) override {
    if (on && flaw_ == Flaw::fault_acknowledged_away) fault_hidden_ = true;
    return order({kAxisEnable, on ? 1.0 : 0.0});
  }

  [[nodiscard]] Result<void> home() override {
    homing_ = true;
    return order({kAxisHome});
  }

  [[nodiscard]] Result<void> move_to(double target_rad, double velocity, double acceleration) override {
    if (flaw_ == Flaw::takes_nonsense && !std::isfinite(target_rad)) target_rad = 0;
    const auto target = scale_.counts(target_rad);
    const auto speed = scale_.rate(velocity);
    const auto ramp = scale_.rate(acceleration);
    if (!target) return pass(target);
    if (!speed) return pass(speed);
    if (!ramp) return pass(ramp);
    const auto now = state();
    if (!now) return pass(now);
    for (int i = 0; flaw_ == Flaw::no_calls_deadline && i < 8; ++i)
      (void)line_.ask({kAxisRead}, FakeDrive::kReadValues);
    if (now->moving && flaw_ == Flaw::swallows_new_target) return {};
    if (!now->homed && now->moving) {
      if (flaw_ == Flaw::move_lost_in_homing) return {};
      return fail(ErrorCode::busy, "it is homing", "fake");
    }
    if (!now->homed && flaw_ != Flaw::moves_unhomed) return fail(ErrorCode::refused, "home it first", "fake");
    if (!now->enabled && flaw_ != Flaw::silent_without_power) {
      return fail(ErrorCode::device, "it has no power", "fake");
    }
    target_ = *target;
    const double shift = flaw_ == Flaw::arrives_elsewhere ? 2 : 0;
    last_order_ = {kAxisMove, *target + shift, *speed * (flaw_ == Flaw::too_fast ? 2.0 : 1.0), 1.0 * *ramp};
    auto sent = order(*last_order_);
    if (flaw_ == Flaw::silent_without_power) return {};
    return sent;
  }

  [[nodiscard]] Result<void> move_by(double delta_rad, double velocity, double acceleration) override {
    if (flaw_ == Flaw::jogs_nonsense && !std::isfinite(delta_rad)) delta_rad = 0.01;
    const auto by = scale_.counts(delta_rad);
    const auto speed = scale_.rate(velocity);
    const auto ramp = scale_.rate(acceleration);
    if (!by) return pass(by);
    if (!speed) return pass(speed);
    if (!ramp) return pass(ramp);
    const auto now = state();
    if (!now) return pass(now);
    if (now->moving) return fail(ErrorCode::busy, "it moves", "fake");
    if (flaw_ == Flaw::homed_by_a_jog) believed_homed_ = true;
    const double from = flaw_ == Flaw::jogs_to_an_angle ? 0 : now->position_rad / FakeDrive::kStep_rad;
    return order({kAxisMove, from + *by, *speed * (flaw_ == Flaw::jogs_fast ? 2.0 : 1.0), 1.0 * *ramp});
  }

  [[nodiscard]] Result<void> stop() override {
    if (flaw_ == Flaw::loses_stop) return {};
    if (flaw_ == Flaw::no_stop_after_bad_answer && line_.last_was_bad()) {
      return fail(ErrorCode::device, "the line is bad", "fake");
    }
    if (flaw_ == Flaw::stops_late) {
      base::WaitSlot nobody_calls;
      (void)clock_.wait(nobody_calls, clock_.now() + std::chrono::milliseconds(300), base::WaitFor::rig);
    }
    if (flaw_ == Flaw::stop_forgets_home) forgotten_ = true;
    last_order_.reset();
    return order({kAxisStop});
  }

  [[nodiscard]] Result<AxisState> state() override {
    const int before = line_.times_back();
    const auto read = line_.ask({kAxisRead}, FakeDrive::kReadValues);
    if (!read) {
      if (flaw_ == Flaw::makes_up_state && last_) return *last_;
      return pass(read);
    }
    if (line_.times_back() != before) on_return();
    return judged(*read);
  }

 private:
  void on_return() {
    if (flaw_ == Flaw::resends_target && last_order_) (void)order(*last_order_);
    if (flaw_ == Flaw::homed_on_return && homing_) believed_homed_ = true;
  }

  AxisState judged(const Words& read) {
    AxisState now;
    now.position_rad = scale_.radians(read[0]);
    now.moving = read[1] != 0;
    now.homed = read[2] != 0 && !forgotten_;
    now.enabled = read[3] != 0;
    if (read[4] != 0 && flaw_ != Flaw::hides_fault && !fault_hidden_) now.fault = "overload";
    now.at_low_limit = read[flaw_ == Flaw::swapped_limits ? 6 : 5] != 0;
    now.at_high_limit = read[flaw_ == Flaw::swapped_limits ? 5 : 6] != 0;
    embellish(now);
    if (now.homed) homing_ = false;
    memory_.homed = memory_.homed || now.homed;
    last_ = now;
    return now;
  }

  // What is not as the device said it.
  void embellish(AxisState& now) {
    if (flaw_ == Flaw::arrives_elsewhere) now.position_rad -= 2 * FakeDrive::kStep_rad;
    if (flaw_ == Flaw::arrived_too_early && now.homed &&
        std::abs(now.position_rad - scale_.radians(target_)) < 0.005) {
      now.moving = false;
      now.position_rad = scale_.radians(target_);
    }
    if (flaw_ == Flaw::homed_by_its_file && memory_.homed) now.homed = true;
    if (flaw_ == Flaw::believes_homed && last_ && last_->homed) now.homed = true;
    if (believed_homed_) now.homed = true;
    if (flaw_ == Flaw::homed_after_abort && homing_ && !now.moving) now.homed = true;
    if (flaw_ == Flaw::homed_too_early && homing_) {
      now.homed = true;
      now.moving = false;
    }
  }

  Result<void> order(const Words& request) {
    const auto taken = line_.ask(request, 1);
    if (!taken) return pass(taken);
    if (taken->front() != 0) return {};
    return fail(ErrorCode::device, "the drive refuses", "fake");
  }

  base::Clock& clock_;
  FakeMemory& memory_;
  const Flaw flaw_;
  FakeLine line_;
  const CountScale scale_{1 / FakeDrive::kStep_rad, 0, false};
  std::optional<AxisState> last_;
  std::optional<Words> last_order_;
  double target_ = 0;
  bool homing_ = false, forgotten_ = false, fault_hidden_ = false, believed_homed_ = false;
};

}  // namespace

std::unique_ptr<Axis> make_fake_axis(FakeWire& wire, base::Clock& clock, FakeMemory& memory, Flaw flaw) {
  return std::make_unique<FakeAxis>(wire, clock, memory, flaw);
}

}  // namespace rig::drivers::conformance
