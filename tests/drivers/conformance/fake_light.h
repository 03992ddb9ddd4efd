// A lamp and the fake driver's light before it, right but for its flaw.
#pragma once

#include <memory>

#include "tests/drivers/conformance/fake_wire.h"

namespace rig::drivers::conformance {

inline constexpr int kLightRead = 200, kLightLevel = 201, kLightShutter = 202;

/// Answers level and shutter.
class FakeLamp final : public LightPeer {
 public:
  static constexpr std::size_t kReadValues = 2;

  explicit FakeLamp(Flaw flaw) : flaw_(flaw) {}
  [[nodiscard]] double level() override { return open_ ? level_ : 0; }
  [[nodiscard]] Words answer(const Words& request);

 private:
  const Flaw flaw_;
  double level_ = 0;
  bool open_ = false;
};

[[nodiscard]] std::unique_ptr<Light> make_fake_light(FakeWire& wire, base::Clock& clock, Flaw flaw);

}  // namespace rig::drivers::conformance
