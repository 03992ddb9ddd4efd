// Digital lines: no press is missed, no level is invented.
#include "drivers/conformance/check_lists.h"
#include "drivers/conformance/opened.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

class LinesSession {
 public:
  explicit LinesSession(Bench& bench)
      : bench_(bench), test(lines_of(bench)), waiting(bench.clock()), opened(bench, test.device) {
    look_up();
  }

  [[nodiscard]] DigitalIo& io() { return opened.device(); }
  [[nodiscard]] Wire& wire() { return bench_.wire(); }
  [[nodiscard]] LinesPeer& peer() { return *test.peer; }

  void reopen() {
    opened.open();
    look_up();
  }
  void reopen_after_kill() {
    opened.open_after_kill(waiting);
    look_up();
  }

  [[nodiscard]] Result<std::vector<bool>> try_read() {
    return timed(bench_.clock(), kLinesCall, "read", [&] { return io().read(); });
  }
  [[nodiscard]] Result<void> try_set(const std::string& line, bool active) {
    return timed(bench_.clock(), kLinesCall, "set", [&] { return io().set(line, active); });
  }
  [[nodiscard]] std::vector<bool> read() {
    auto levels = must(try_read(), "read");
    require(levels.size() == count_, "read() answered {} levels of {} lines", levels.size(), count_);
    return levels;
  }
  [[nodiscard]] bool input() { return read()[input_]; }
  [[nodiscard]] bool output() { return read()[output_]; }
  /// The one of levels that were read; nothing where the bench has none.
  [[nodiscard]] std::optional<bool> input_of(const std::vector<bool>& levels) const {
    return level_of(levels, input_);
  }
  [[nodiscard]] std::optional<bool> output_of(const std::vector<bool>& levels) const {
    return level_of(levels, output_);
  }

  /// Until read() succeeds several times on end.
  void recover(std::string_view after) {
    constexpr int kOnEnd = 3;
    int fine = 0;
    std::string last = "nothing";
    const bool back = waiting.until(
        [&] {
          const auto now = try_read();
          if (!now) last = told(now.error());
          fine = now ? fine + 1 : 0;
          return fine >= kOnEnd;
        },
        kBackWithin, milliseconds(50));
    require(back, "{}: {:.0f} s later read() still answers {}", after, base::to_seconds(kBackWithin), last);
  }

  void need_input() const {
    if (test.input.empty()) does_not_concern("no input");
  }
  void need_output() const {
    if (test.output.empty()) does_not_concern("no output");
  }

  /// Within the bench's bound the input is read so.
  void require_input(bool active, std::string_view when) {
    const bool so = waiting.until([&] { return input() == active; }, test.seen_within);
    require(so, "{}: {} ms later the input '{}' still reads {}", when, test.seen_within.count(), test.input,
            active ? "inactive" : "active");
  }
  void require_output(bool active, std::string_view when) {
    const bool so = waiting.until([&] { return peer().output(test.output) == active; }, test.seen_within);
    require(so, "{}: {} ms later the output '{}' is still {}", when, test.seen_within.count(), test.output,
            active ? "inactive" : "active");
  }

 private:
  static LinesUnderTest lines_of(Bench& bench) {
    auto lines = bench.lines();
    if (!lines) does_not_concern("no lines");
    require(lines->peer != nullptr, "the bench has nobody at the other end of its lines");
    return *lines;
  }

  [[nodiscard]] std::optional<bool> level_of(const std::vector<bool>& levels, std::size_t line) const {
    require(levels.size() == count_, "read() answered {} levels of {} lines", levels.size(), count_);
    if (line == count_) return std::nullopt;
    return levels[line];
  }

  void look_up() {
    const std::vector<Line> lines = io().lines();
    count_ = lines.size();
    const auto find = [&](const std::string& name, bool output) {
      if (name.empty()) return count_;
      for (std::size_t i = 0; i < lines.size(); ++i) {
        if (lines[i].name != name) continue;
        require(lines[i].output == output, "the line '{}' is said to be an {}", name,
                output ? "input" : "output");
        return i;
      }
      fail_check("lines() does not name '{}'", name);
    };
    input_ = find(test.input, false);
    output_ = find(test.output, true);
  }

  Bench& bench_;

 public:
  const LinesUnderTest test;
  Waiting waiting;
  Opened<DigitalIo> opened;

 private:
  std::size_t count_ = 0, input_ = 0, output_ = 0;
};

Outcome inputs_are_seen(Bench& bench) {
  LinesSession s(bench);
  s.need_input();
  s.require_input(false, "at rest");
  for (int i = 0; i < 3; ++i) {
    s.peer().set_input(s.test.input, true);
    s.require_input(true, "pressed");
    s.waiting.pause(s.test.seen_within);
    require(s.input(), "the input is held, and reads inactive after a while");
    s.peer().set_input(s.test.input, false);
    s.require_input(false, "let go");
    require(!s.input(), "the input was let go, and reads active again");
  }
  return {};
}

Outcome short_press(Bench& bench) {
  LinesSession s(bench);
  s.need_input();
  s.require_input(false, "at rest");
  for (int i = 0; i < 3; ++i) {
    s.peer().set_input(s.test.input, true);
    s.waiting.pause(s.test.seen_within);
    s.peer().set_input(s.test.input, false);
    s.waiting.pause(2 * s.test.seen_within);
    require(s.input(), "a press of {} ms between two reads was missed", s.test.seen_within.count());
    require(!s.input(), "a press that was read once is read again");
  }
  return {};
}

Outcome outputs(Bench& bench) {
  LinesSession s(bench);
  s.need_output();
  for (const bool active : {true, false, true, true, false}) {
    must(s.try_set(s.test.output, active), fmt::format("set({}, {})", s.test.output, active));
    s.require_output(active, fmt::format("set to {}", active));
    require(s.output() == active, "the output was set to {}, and read() says {}", active, !active);
  }
  return {};
}

Outcome defined_at_rest(Bench& bench) {
  LinesSession s(bench);
  s.need_output();
  const bool rest = s.test.output_at_rest;
  for (const Line& line : s.io().lines()) {
    if (line.name != s.test.output) continue;
    require(!line.at_rest || *line.at_rest == rest, "lines() says that the output rests {}",
            rest ? "inactive" : "active");
  }
  s.require_output(rest, "opened");
  require(s.output() == rest, "opened, and read() says that the output is {}", rest ? "inactive" : "active");
  for (int i = 0; i < 2; ++i) {
    must(s.try_set(s.test.output, !rest), "set");
    s.require_output(!rest, "set");
    s.opened.close();
    s.require_output(rest, "closed");
    s.reopen();
    s.require_output(rest, "opened again");
    require(s.output() == rest, "opened again, and read() says that the output is {}",
            rest ? "inactive" : "active");
  }
  return {};
}

Outcome wrong_lines(Bench& bench) {
  LinesSession s(bench);
  const auto before = s.read();
  for (const bool active : {true, false}) {
    require(!s.try_set("no_such_line", active), "a line that does not exist was set");
    require(!s.try_set("", active), "a line without a name was set");
    if (!s.test.input.empty())
      require(!s.try_set(s.test.input, active), "the input '{}' was set", s.test.input);
  }
  require(s.read() == before, "lines changed though no set was accepted");
  return {};
}

void require_lost(LinesSession& s) {
  std::string last;
  const bool lost = s.waiting.until(
      [&] {
        const auto levels = s.try_read();
        last = levels ? "levels" : told(levels.error());
        return !levels && levels.error().code == ErrorCode::lost;
      },
      kLostWithin, milliseconds(50));
  require(lost, "{:.0f} s after they were unplugged read() answers {} instead of lost",
          base::to_seconds(kLostWithin), last);
  for (int i = 0; i < 3; ++i)
    require_always(!s.try_read(), "read() answered levels of lines that are unplugged");
  if (s.test.output.empty()) return;
  require(!s.try_set(s.test.output, !s.test.output_at_rest), "an output was set with its device unplugged");
}

void require_back(LinesSession& s) {
  require(s.wire().restore(), "the bench cannot plug in what it unplugged");
  s.recover("lost and back");
}

Outcome lost_and_back(Bench& bench) {
  LinesSession s(bench);
  const bool rest = s.test.output_at_rest;
  for (int i = 0; i < 2; ++i) {
    if (!s.test.output.empty()) must(s.try_set(s.test.output, !rest), "set");
    if (!s.wire().cut()) not_proven("this bench cannot unplug the lines");
    require_lost(s);
    require_back(s);
    if (!s.test.output.empty()) {
      s.require_output(rest, "lost and back");
      require(s.output() == rest, "lost and back, and read() says that the output is {}",
              rest ? "inactive" : "active");
      must(s.try_set(s.test.output, !rest), "set once it is back");
      s.require_output(!rest, "set once it is back");
    }
    if (s.test.input.empty()) continue;
    // What was pressed before it was lost is forgotten, or told once; then it is what it is.
    (void)s.read();
    s.require_input(false, "lost and back");
    s.peer().set_input(s.test.input, true);
    s.require_input(true, "pressed once it is back");
    s.peer().set_input(s.test.input, false);
    s.require_input(false, "let go once it is back");
  }
  return {};
}

Outcome closed_and_opened(Bench& bench) {
  LinesSession s(bench);
  s.need_input();
  s.require_input(false, "at rest");
  s.opened.close();
  s.peer().set_input(s.test.input, true);
  s.reopen();
  s.require_input(true, "pressed while the module was closed");
  s.opened.close();
  s.peer().set_input(s.test.input, false);
  s.reopen();
  s.require_input(false, "let go while the module was closed");
  return {};
}

// Nobody put the outputs to rest: they are once the module is open again.
Outcome killed_with_its_output_set(Bench& bench) {
  LinesSession s(bench);
  const bool rest = s.test.output_at_rest;
  for (const bool held : {true, false}) {
    const auto victim = s.opened.start_victim(SetLineTask{s.test.output, !rest});
    if (!s.test.output.empty()) s.require_output(!rest, "set before the module was killed");
    victim->kill();
    if (!s.test.input.empty()) s.peer().set_input(s.test.input, held);
    s.reopen_after_kill();
    if (!s.test.output.empty()) {
      s.require_output(rest, "opened after it was killed");
      require(s.output() == rest, "opened after it was killed, and read() says that the output is {}",
              rest ? "inactive" : "active");
    }
    if (!s.test.input.empty()) {
      s.require_input(held, held ? "pressed while the module was gone" : "let go while the module was gone");
    }
  }
  if (s.test.output.empty()) return {};
  must(s.try_set(s.test.output, !rest), "set after it was killed and opened");
  s.require_output(!rest, "set after it was killed and opened");
  return {};
}

Outcome absent_at_opening(Bench& bench) {
  LinesSession s(bench);
  s.opened.close();
  if (!s.wire().cut()) not_proven("this bench cannot unplug the lines");
  require_told_or_lost(bench);
  require(s.wire().restore(), "the bench cannot plug in what it unplugged");
  s.reopen();
  s.recover("opened again with the lines back");
  if (!s.test.input.empty()) {
    s.peer().set_input(s.test.input, true);
    s.require_input(true, "pressed with the lines back");
  }
  if (s.test.output.empty()) return {};
  s.require_output(s.test.output_at_rest, "opened again with the lines back");
  must(s.try_set(s.test.output, !s.test.output_at_rest), "set with the lines back");
  s.require_output(!s.test.output_at_rest, "set with the lines back");
  return {};
}

void require_wire_error(const base::Error& error, std::string_view call, std::string_view when) {
  require(error.code == ErrorCode::lost || error.code == ErrorCode::device,
          "{}: {} answered {}; an error of the wire is lost or device", when, call, told(error));
}

// With the input held and the output on, so that a level that was invented would show. A module that calls an
// answer that is missing a loss has its outputs at rest afterwards, and says that, too.
void spoil_a_few(LinesSession& s, Spoil how, int answers, std::string_view when) {
  const bool has_output = !s.test.output.empty();
  (void)s.wire().spoil(how, answers);
  for (int i = 0; i < 5; ++i) {
    const bool before = has_output && s.peer().output(s.test.output);
    const auto levels = s.try_read();
    if (!levels) {
      require_wire_error(levels.error(), "read()", when);
      continue;
    }
    require_always(s.input_of(*levels).value_or(true),
                   "{}: the input is held, and read() says that it is inactive", when);
    const bool after = has_output && s.peer().output(s.test.output);
    require_always(before != after || s.output_of(*levels).value_or(after) == after,
                   "{}: the output is {}, and read() says that it is not", when, after ? "on" : "off");
  }
  s.recover(when);
  if (!has_output) return;
  must(s.try_set(s.test.output, true), fmt::format("set {}", when));
  s.require_output(true, when);
  (void)s.wire().spoil(how, answers);
  const auto set = s.try_set(s.test.output, false);
  if (!set) require_wire_error(set.error(), "set", when);
  s.recover(when);
  if (set) s.require_output(false, when);
  require(s.output() == s.peer().output(s.test.output), "{}: read() does not say what the output is", when);
  must(s.try_set(s.test.output, true), fmt::format("set {}", when));
  s.require_output(true, when);
}

Outcome spoilt_answers(Bench& bench) {
  LinesSession s(bench);
  if (!s.test.input.empty()) {
    s.peer().set_input(s.test.input, true);
    s.require_input(true, "held");
  }
  if (!s.test.output.empty()) {
    must(s.try_set(s.test.output, true), "set");
    s.require_output(true, "set");
  }
  int shown = 0;
  std::string not_shown;
  for (const auto& [how, name] : {std::pair{Spoil::missing, "missing"}, std::pair{Spoil::garbage, "garbled"},
                                  std::pair{Spoil::late, "late"}, std::pair{Spoil::duplicate, "doubled"}}) {
    // One to see whether the bench can.
    if (!s.wire().spoil(how, 1)) {
      not_shown += not_shown.empty() ? name : fmt::format(", {}", name);
      continue;
    }
    s.recover(fmt::format("after one {} answer", name));
    for (int answers = 1; answers <= 3; ++answers) {
      spoil_a_few(s, how, answers,
                  fmt::format("after {} {} answer{}", answers, name, answers == 1 ? "" : "s"));
    }
    ++shown;
  }
  if (shown == 0) not_proven("this bench cannot spoil answers");
  if (!not_shown.empty()) not_proven("this bench cannot make answers {}; the others passed", not_shown);
  return {};
}

}  // namespace

std::vector<Check> lines_checks() {
  return {{"lines: an input is seen within its bound", inputs_are_seen},
          {"lines: a short press is not missed", short_press},
          {"lines: outputs are set and read back", outputs},
          {"lines: a defined state on start and on exit", defined_at_rest},
          {"lines: unknown lines and inputs are not set", wrong_lines},
          {"lines: lost and back", lost_and_back},
          {"lines: absent at opening", absent_at_opening},
          {"lines: closed and opened again", closed_and_opened},
          {"lines: killed with its output set and opened again", killed_with_its_output_set},
          {"lines: spoilt answers", spoilt_answers}};
}

}  // namespace rig::drivers::conformance
