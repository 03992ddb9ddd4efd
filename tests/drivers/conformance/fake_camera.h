// A sensor and the fake driver's camera before it, right but for its flaw.
#pragma once

#include <memory>

#include "tests/drivers/conformance/fake_wire.h"

namespace rig::drivers::conformance {

/// Paints its exposure into every pixel, in units of 10 us.
class FakeSensor final : public CameraPeer {
 public:
  static constexpr int kWidth = 16, kHeight = 8;
  static constexpr double kUnit_s = 1e-5;

  struct Frame {
    double exposure_s = 0;
    base::Time started, ready;
    std::uint64_t number = 0;
    bool corrupt = false, lost = false;
  };

  explicit FakeSensor(base::Clock& clock) : clock_(clock) {}
  [[nodiscard]] std::optional<double> exposure_in(std::span<const std::uint16_t> pixels) override;
  bool corrupt_next() override { return corrupt_next_ = true; }
  bool drop_next() override { return drop_next_ = true; }

  void begin(double exposure_s);
  /// The frame being exposed or waiting to be read.
  [[nodiscard]] std::optional<Frame>& frame() { return frame_; }
  static void paint(const Frame& frame, std::span<std::uint16_t> pixels);

 private:
  base::Clock& clock_;
  std::optional<Frame> frame_;
  std::uint64_t numbers_ = 0;
  bool corrupt_next_ = false, drop_next_ = false;
};

[[nodiscard]] std::unique_ptr<Camera> make_fake_camera(FakeSensor& sensor, FakeWire& wire, base::Clock& clock,
                                                       Flaw flaw);

}  // namespace rig::drivers::conformance
