// A box of lines and the fake driver before it, right but for its flaw.
#pragma once

#include <memory>

#include "tests/drivers/conformance/fake_wire.h"

namespace rig::drivers::conformance {

inline constexpr int kLinesRead = 300, kLinesSet = 301;

/// Answers the input, whether it was active since the last answer, and the output.
class FakeLinesBox final : public LinesPeer {
 public:
  static constexpr std::size_t kReadValues = 3;

  void set_input(const std::string& line, bool active) override;
  [[nodiscard]] bool output(const std::string& line) override { return line == "relay" && output_; }
  [[nodiscard]] Words answer(const Words& request);
  /// Its watchdog: nobody talks to it any more.
  void abandon() { output_ = false; }

 private:
  bool input_ = false, pressed_ = false, output_ = false;
};

[[nodiscard]] std::unique_ptr<DigitalIo> make_fake_lines(FakeWire& wire, base::Clock& clock, Flaw flaw);

}  // namespace rig::drivers::conformance
