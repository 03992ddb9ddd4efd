// Answers that are missing, garbled, late or doubled: the state stays the truth, and no answer is taken for
// that to another question.
#include <cmath>

#include "drivers/conformance/axis_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

// More than any driver's attempts for one transaction.
constexpr int kMany = 12;

const char* name_of(Spoil how) {
  switch (how) {
    case Spoil::missing:
      return "missing";
    case Spoil::garbage:
      return "garbled";
    case Spoil::late:
      return "late";
    case Spoil::duplicate:
      return "doubled";
  }
  return "spoilt";
}

void spoil(AxisSession& s, Spoil how, int answers) {
  if (!s.wire().spoil(how, answers)) not_proven("this bench cannot make answers {}", name_of(how));
}

// Goes somewhere without asking state(): what the driver read last is no longer so.
void go_unread(AxisSession& s, double target) {
  s.start(target);
  (void)s.waiting().until([&] { return s.peer().moving(); }, std::chrono::milliseconds(500),
                          std::chrono::milliseconds(2));
  s.wait_peer_stands(s.longest(s.high() - s.low()), "after a move was started");
  require(std::abs(s.peer().position_rad() - target) <= 2 * s.step(), "a move to {} ended at {}", deg(target),
          deg(s.peer().position_rad()));
}

bool right_error(ErrorCode code) {
  return code == ErrorCode::lost || code == ErrorCode::device;
}

// Asks so often; what comes is an error of the right kind, or the truth.
int ask(AxisSession& s, int times, std::string_view when) {
  int failed = 0;
  for (int i = 0; i < times; ++i) {
    const auto now = s.try_state();
    if (now) {
      s.require_true_at_rest(*now, when);
      continue;
    }
    require(right_error(now.error().code), "{}: state() answered {}; an error of the wire is lost or device",
            when, told(now.error()));
    ++failed;
  }
  return failed;
}

// Read on the way, and again at its end: what was true on the way is not told at the end.
void while_moving(AxisSession& s, Spoil how, int answers, std::string_view when) {
  s.arrive(s.low());
  s.start(s.high());
  s.wait_under_way(s.low(), 0.1 * (s.high() - s.low()));
  spoil(s, how, answers);
  const auto now = s.try_state();
  if (!now) {
    require(right_error(now.error().code), "{} to a reading while moving: it answered {}", when,
            told(now.error()));
  }
  s.wait_peer_stands(s.longest(s.high() - s.low()), "after a move was started");
  (void)ask(s, 5, when);
  s.recover(when);
  s.require_true_at_rest(s.state(), when);
}

// One spoilt answer to a reading, to a move, and to readings that follow it, at places that differ each time.
void a_few(AxisSession& s, Spoil how) {
  double share = 0.1;
  for (const int answers : {1, 3}) {
    const std::string when =
        fmt::format("after {} {} answer{}", answers, name_of(how), answers == 1 ? "" : "s");
    share = share > 0.5 ? share - 0.45 : share + 0.4;
    go_unread(s, s.at(share));
    spoil(s, how, answers);
    (void)ask(s, 5, when);
    s.recover(when);
    s.require_true_at_rest(s.state(), when);

    share = share > 0.5 ? share - 0.45 : share + 0.4;
    spoil(s, how, answers);
    const auto moved = s.try_move(s.at(share));
    if (moved) {
      s.recover(when);
      s.follow_to(s.at(share));
    } else {
      require(right_error(moved.error().code), "{} to a move: it answered {}", when, told(moved.error()));
      s.recover(when);
      // Whether the device took it or not, the state says which.
      s.wait_peer_stands(s.longest(s.high() - s.low()), "after a move that answered an error");
      s.require_true_at_rest(s.wait_until_still(s.braking()), when);
    }
    (void)ask(s, 5, when);
    s.make_ready();
    while_moving(s, how, answers, when);
  }
}

// So many that no retry helps: an error, never a state of its own making; and whole again afterwards.
void many(AxisSession& s, Spoil how, bool only_lost) {
  const std::string when = fmt::format("with {} {} answers on end", kMany, name_of(how));
  go_unread(s, s.at(0.9));
  spoil(s, how, kMany);
  int failed = 0;
  for (int i = 0; i < 3 && failed == 0; ++i) {
    const auto now = s.try_state();
    if (now) {
      s.require_true_at_rest(*now, when);
      continue;
    }
    ++failed;
    require(only_lost ? now.error().code == ErrorCode::lost : right_error(now.error().code),
            "{}: state() answered {} instead of lost{}", when, told(now.error()),
            only_lost ? "" : " or device");
  }
  require(failed > 0, "{}: state() went on to answer", when);
  s.recover(when);
  s.require_true_at_rest(s.wait_until_still(s.braking()), when);
  s.require_refusal_unless_homed(when);
  s.make_ready();
  s.arrive(s.at(0.2));
}

Outcome missing_answers(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  spoil(s, Spoil::missing, 1);
  s.require_true_at_rest(must(s.try_state(), "state with one missing answer"), "with one missing answer");
  a_few(s, Spoil::missing);
  many(s, Spoil::missing, true);
  return {};
}

// What state() says on such a line is so, or an error.
void look_honestly(AxisSession& s, std::string_view when) {
  const bool moved = s.peer().moving();
  const auto now = s.try_state();
  if (!now) {
    require(right_error(now.error().code), "{}: state() answered {}; an error of the wire is lost or device",
            when, told(now.error()));
    return;
  }
  // One that says "moving" has not seen the end yet, or does not know.
  if (now->moving) return;
  require(!moved || !s.peer().moving(), "{}: state() says not moving, and the device moves, at {}", when,
          deg(s.peer().position_rad()));
  s.require_true_at_rest(*now, when);
}

// Done, or an error that says the truth: also of a device that the driver had to look for again meanwhile.
void judge(const Result<void>& answer, std::string_view call, std::string_view when) {
  if (answer) return;
  const ErrorCode code = answer.error().code;
  require(right_error(code) || code == ErrorCode::refused || code == ErrorCode::busy, "{}: {} answered {}",
          when, call, told(answer.error()));
}

// Each question may be answered at its last attempt: a call of many takes their sum if nothing bounds it.
Outcome most_missing(Bench& bench) {
  constexpr std::string_view kWhen = "with two of three answers missing";
  constexpr int kForAll = 100'000;
  AxisSession s(bench);
  s.stand_at(0.2);
  if (!s.wire().thin_out(kForAll)) not_proven("this bench cannot make two of three answers missing");
  for (const double share : {0.7, 0.3}) {
    look_honestly(s, kWhen);
    judge(s.try_enable(true), "enable(true)", kWhen);
    judge(s.try_move(s.at(share)), "move_to", kWhen);
    look_honestly(s, kWhen);
    const int before = s.peer().stops_seen();
    judge(s.try_stop(), "stop", kWhen);
    const bool told_to_stop = s.waiting().until([&] { return s.peer().stops_seen() > before; },
                                                s.test().stop_bound, milliseconds(1));
    require(told_to_stop, "{}: the command to stop is not on the wire {} ms after stop() returned", kWhen,
            s.test().stop_bound.count());
    s.wait_peer_stands(s.braking(), "after a stop");
    look_honestly(s, kWhen);
  }
  judge(s.try_home(), "home", kWhen);
  look_honestly(s, kWhen);
  (void)s.wire().thin_out(0);
  s.recover(kWhen);
  s.wait_peer_stands(s.longest(s.high() - s.low()), "after two of three answers were missing");
  s.require_true_at_rest(s.wait_until_still(s.longest(s.high() - s.low())), kWhen);
  s.make_ready();
  s.arrive(s.at(0.6));
  return {};
}

Outcome garbled_answers(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  a_few(s, Spoil::garbage);
  many(s, Spoil::garbage, false);
  return {};
}

Outcome late_answers(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  a_few(s, Spoil::late);
  return {};
}

Outcome doubled_answers(Bench& bench) {
  AxisSession s(bench);
  s.stand_at(0.5);
  a_few(s, Spoil::duplicate);
  return {};
}

}  // namespace

std::vector<Check> axis_wire_checks() {
  return {{"axis: missing answers", missing_answers},
          {"axis: most answers missing", most_missing},
          {"axis: garbled answers", garbled_answers},
          {"axis: late answers", late_answers},
          {"axis: doubled answers", doubled_answers}};
}

}  // namespace rig::drivers::conformance
