#include "tests/drivers/conformance/fake_light.h"

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;
using base::pass;

Words FakeLamp::answer(const Words& request) {
  const int command = static_cast<int>(request.front());
  if (command == kLightLevel) level_ = request[1] * (flaw_ == Flaw::level_off ? 1.1 : 1);
  if (command == kLightShutter && flaw_ != Flaw::no_shutter) open_ = request[1] != 0;
  if (flaw_ == Flaw::no_shutter) open_ = true;
  return {request.front(), level_, open_ ? 1.0 : 0.0};
}

namespace {

// With two of three answers missing each takes 0.2 s.
constexpr int kManyQuestions = 15;

class FakeLight final : public Light {
 public:
  FakeLight(FakeWire& wire, base::Clock& clock, Flaw flaw) : flaw_(flaw), line_(wire, clock, flaw) {}

  [[nodiscard]] LightCapabilities capabilities() const override { return {true, true, 0}; }

  [[nodiscard]] Result<void> set_level(double level) override {
    if (!(level >= 0 && level <= 1)) return fail(ErrorCode::bad_input, "a level is from 0 to 1", "fake");
    told_ = true;
    believed_ = level;
    return order({kLightLevel, level});
  }

  [[nodiscard]] Result<void> set_shutter(bool open) override {
    return order({kLightShutter, open ? 1.0 : 0.0});
  }

  [[nodiscard]] Result<LightState> state() override {
    for (int i = 0; flaw_ == Flaw::no_calls_deadline && i < kManyQuestions; ++i)
      (void)line_.ask({kLightRead}, FakeLamp::kReadValues);
    const auto read = line_.ask({kLightRead}, FakeLamp::kReadValues);
    if (!read && flaw_ == Flaw::makes_up_state) return LightState{true, true, believed_, true, 0, {}};
    if (!read) return pass(read);
    LightState now;
    now.level = read->at(0);
    if (flaw_ == Flaw::level_believed) now.level = believed_;
    if (flaw_ == Flaw::off_by_belief && !told_) now.level = 0;
    now.on = now.level > 0;
    now.shutter_open = read->at(1) != 0;
    now.warm = now.on;
    return now;
  }

 private:
  Result<void> order(const Words& request) {
    const auto answer = line_.ask(request, FakeLamp::kReadValues);
    if (!answer) return pass(answer);
    return {};
  }

  const Flaw flaw_;
  FakeLine line_;
  double believed_ = 0;
  bool told_ = false;
};

}  // namespace

std::unique_ptr<Light> make_fake_light(FakeWire& wire, base::Clock& clock, Flaw flaw) {
  return std::make_unique<FakeLight>(wire, clock, flaw);
}

}  // namespace rig::drivers::conformance
