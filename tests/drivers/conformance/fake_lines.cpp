#include "tests/drivers/conformance/fake_lines.h"

#include <optional>

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;
using base::pass;

void FakeLinesBox::set_input(const std::string& line, bool active) {
  if (line != "button") return;
  input_ = active;
  pressed_ = pressed_ || active;
}

Words FakeLinesBox::answer(const Words& request) {
  if (static_cast<int>(request.front()) == kLinesSet) output_ = request[1] != 0;
  Words answer{request.front(), input_ ? 1.0 : 0.0, pressed_ ? 1.0 : 0.0, output_ ? 1.0 : 0.0};
  if (static_cast<int>(request.front()) == kLinesRead) pressed_ = input_;
  return answer;
}

namespace {

class FakeLines final : public DigitalIo {
 public:
  FakeLines(FakeWire& wire, base::Clock& clock, Flaw flaw)
      : clock_(clock), flaw_(flaw), line_(wire, clock, flaw) {
    if (flaw_ != Flaw::leaves_output && flaw_ != Flaw::rests_only_in_order)
      (void)line_.ask({kLinesSet, 0}, FakeLinesBox::kReadValues);
  }
  ~FakeLines() override {
    if (flaw_ != Flaw::leaves_output) (void)line_.ask({kLinesSet, 0}, FakeLinesBox::kReadValues);
  }
  FakeLines(const FakeLines&) = delete;
  FakeLines& operator=(const FakeLines&) = delete;

  [[nodiscard]] std::vector<Line> lines() const override {
    return {{"button", false}, {"relay", true, false}};
  }

  [[nodiscard]] Result<std::vector<bool>> read() override {
    const auto read = line_.ask({kLinesRead}, FakeLinesBox::kReadValues);
    if (!read && flaw_ == Flaw::invents_levels) return std::vector<bool>{false, false};
    if (!read) return pass(read);
    return std::vector<bool>{input_of(*read),
                             flaw_ == Flaw::output_read_believed ? !told_ : read->at(2) != 0};
  }

  [[nodiscard]] Result<void> set(const std::string& line, bool active) override {
    if (line != "relay" && flaw_ != Flaw::sets_anything) {
      return fail(ErrorCode::bad_input, "there is no output '" + line + "'", "fake");
    }
    told_ = active;
    const auto answer = line_.ask({kLinesSet, active ? 1.0 : 0.0}, FakeLinesBox::kReadValues);
    if (!answer) return pass(answer);
    return {};
  }

 private:
  bool input_of(const Words& read) {
    const bool level = read[0] != 0;
    const bool active = read[1] != 0 && flaw_ != Flaw::misses_press ? true : level;
    if (flaw_ == Flaw::input_by_edges) {
      // The first look shows no edge.
      changed_ = changed_ || (seen_ && *seen_ != level);
      seen_ = level;
      return changed_ && active;
    }
    if (flaw_ != Flaw::slow_input) return active;
    const base::Time now = clock_.now();
    if (level != (seen_ && *seen_)) {
      seen_ = level;
      since_ = now;
    }
    return now - since_ > std::chrono::seconds(1) ? level : !level;
  }

  base::Clock& clock_;
  const Flaw flaw_;
  FakeLine line_;
  std::optional<bool> seen_;
  base::Time since_{};
  bool told_ = false, changed_ = false;
};

}  // namespace

std::unique_ptr<DigitalIo> make_fake_lines(FakeWire& wire, base::Clock& clock, Flaw flaw) {
  return std::make_unique<FakeLines>(wire, clock, flaw);
}

}  // namespace rig::drivers::conformance
