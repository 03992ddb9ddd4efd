// A wire of words between a fake driver and the fake devices at its other end, which spoils answers as it is
// told.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "drivers/common/retry.h"
#include "drivers/conformance/bench.h"
#include "tests/drivers/conformance/flaws.h"

namespace rig::drivers::conformance {

/// A request or an answer: a command, which an answer repeats, and its values.
using Words = std::vector<double>;

class FakeWire final : public Wire {
 public:
  explicit FakeWire(base::Clock& clock) : clock_(clock) {}

  bool cut() override;
  bool restore() override;
  bool spoil(Spoil how, int answers) override;
  bool thin_out(int answers) override;

  /// Who answers at the other end.
  void connect(std::function<Words(const Words&)> device) { device_ = std::move(device); }
  [[nodiscard]] bool is_cut() const { return cut_; }

  /// The driver's side. What has come and nobody read is dropped by `discard`.
  void send(const Words& request);
  [[nodiscard]] Result<Words> receive(std::chrono::milliseconds within);
  void discard();

 private:
  base::Clock& clock_;
  std::function<Words(const Words&)> device_;
  bool cut_ = false;
  Spoil how_ = Spoil::missing;
  int spoilt_ = 0, thinned_ = 0;
  struct OnItsWay {
    base::Time arrives;
    Words words;
  };
  std::deque<OnItsWay> on_its_way_;  // in the order of their arrival
};

/// The driver's end of the wire: questions, with retries.
class FakeLine {
 public:
  FakeLine(FakeWire& wire, base::Clock& clock, Flaw flaw) : wire_(wire), clock_(clock), flaw_(flaw) {}

  /// The values of the answer, of which there are `values`.
  [[nodiscard]] Result<Words> ask(const Words& request, std::size_t values);
  /// Grows when the device was gone and is there again.
  [[nodiscard]] int times_back() const { return times_back_; }
  [[nodiscard]] bool last_was_bad() const { return last_was_bad_; }

 private:
  FakeWire& wire_;
  base::Clock& clock_;
  const Flaw flaw_;
  const RetryPolicy policy_{3, std::chrono::milliseconds(100)};
  bool lost_ = false, last_was_bad_ = false;
  int times_back_ = 0;
};

}  // namespace rig::drivers::conformance
