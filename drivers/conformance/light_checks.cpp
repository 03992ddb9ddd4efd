// Lights: what was set shines, and what is told is what shines.
#include <cmath>
#include <limits>

#include "drivers/conformance/check_lists.h"
#include "drivers/conformance/opened.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

// Half a step of eight bits, which is what lights are set with, and rounding.
constexpr double kLevelRoom = 0.5 / 255 + 0.001;

class LightSession {
 public:
  explicit LightSession(Bench& bench)
      : bench_(bench), test_(light_of(bench)), waiting(bench.clock()), opened(bench, test_.device) {
    capabilities = light().capabilities();
  }

  [[nodiscard]] Light& light() { return opened.device(); }
  [[nodiscard]] Wire& wire() { return bench_.wire(); }
  [[nodiscard]] double shines() { return test_.peer->level(); }

  [[nodiscard]] Result<void> try_level(double level) {
    return timed(bench_.clock(), kLightCall, "set_level", [&] { return light().set_level(level); });
  }
  [[nodiscard]] Result<void> try_shutter(bool open) {
    return timed(bench_.clock(), kLightCall, "set_shutter", [&] { return light().set_shutter(open); });
  }
  [[nodiscard]] Result<LightState> try_state() {
    return timed(bench_.clock(), kLightCall, "state", [&] { return light().state(); });
  }
  [[nodiscard]] LightState state() { return must(try_state(), "state"); }
  void set_level(double level) { must(try_level(level), fmt::format("set_level({})", level)); }

  void open_shutter() {
    if (capabilities.has_shutter) must(try_shutter(true), "set_shutter(true)");
  }

  /// What the state says that shines.
  [[nodiscard]] double claimed(const LightState& now) const {
    if (!now.on || (capabilities.has_shutter && !now.shutter_open)) return 0;
    return capabilities.has_level ? now.level : 1;
  }

  /// Within a moment the light gives this, and says so.
  void require_shines(double level, std::string_view when) {
    LightState now;
    const bool so = waiting.until(
        [&] {
          now = state();
          return std::abs(shines() - level) <= kLevelRoom && std::abs(claimed(now) - level) <= kLevelRoom;
        },
        kShownWithin);
    require(so, "{}: {} of the full level has to shine; {} does, and state() says {}", when, level, shines(),
            claimed(now));
    require(now.fault.empty(), "{}: state() shows a fault: {}", when, now.fault);
  }

  /// The state is the truth about what shines, whatever that is.
  void require_true(std::string_view when) {
    LightState now;
    const bool so = waiting.until(
        [&] {
          now = state();
          return std::abs(shines() - claimed(now)) <= kLevelRoom;
        },
        kShownWithin);
    require(so, "{}: state() says that {} of the full level shines, and {} does", when, claimed(now),
            shines());
  }

  /// Until state() succeeds several times on end.
  void recover(std::string_view after) {
    constexpr int kOnEnd = 3;
    int fine = 0;
    std::string last = "nothing";
    const bool back = waiting.until(
        [&] {
          const auto now = try_state();
          if (!now) last = told(now.error());
          fine = now ? fine + 1 : 0;
          return fine >= kOnEnd;
        },
        kBackWithin, milliseconds(50));
    require(back, "{}: {:.0f} s later state() still answers {}", after, base::to_seconds(kBackWithin), last);
  }

  /// Two levels that differ as far as the light can do it.
  [[nodiscard]] double dim() const { return capabilities.has_level ? 0.4 : 0; }

 private:
  static LightUnderTest light_of(Bench& bench) {
    auto test = bench.light();
    if (!test) does_not_concern("no light");
    require(test->peer != nullptr, "the bench has nobody who sees its light");
    return *test;
  }

  Bench& bench_;
  const LightUnderTest test_;

 public:
  Waiting waiting;
  Opened<Light> opened;
  LightCapabilities capabilities;
};

Outcome level(Bench& bench) {
  LightSession s(bench);
  require(s.capabilities.warm_up_s >= 0, "the lamp warms up for {} s", s.capabilities.warm_up_s);
  s.open_shutter();
  std::vector<double> levels{1, 0, 1};
  if (s.capabilities.has_level) levels = {1, 0, 0.5, 0.25, 0.75, 1};
  for (const double wanted : levels) {
    s.set_level(wanted);
    s.require_shines(wanted, fmt::format("set_level({})", wanted));
    require(s.state().on == (wanted > 0), "at level {} state() says that it is {}", wanted,
            wanted > 0 ? "off" : "on");
  }
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    require(!s.try_level(bad), "set_level({}) was accepted", bad);
    s.require_shines(1, "after a level that makes no sense");
  }
  return {};
}

Outcome shutter(Bench& bench) {
  LightSession s(bench);
  if (!s.capabilities.has_shutter) does_not_concern("no shutter");
  s.set_level(1);
  for (const bool open : {true, false, true}) {
    must(s.try_shutter(open), fmt::format("set_shutter({})", open));
    s.require_shines(open ? 1 : 0, open ? "with its shutter open" : "with its shutter closed");
    require(s.state().shutter_open == open, "the shutter is {}, and state() does not say so",
            open ? "open" : "closed");
  }
  must(s.try_shutter(false), "set_shutter(false)");
  s.set_level(s.dim());
  s.require_shines(0, "a level that was set behind the closed shutter");
  must(s.try_shutter(true), "set_shutter(true)");
  s.require_shines(s.dim(), "the shutter opened on a level that was set behind it");
  return {};
}

Outcome ended_while_it_shines(Bench& bench, End end) {
  const char* const opened = end == End::closed ? "opened again" : "opened after it was killed";
  LightSession s(bench);
  for (const double before : {1.0, s.dim(), 0.0}) {
    if (end == End::closed) {
      s.open_shutter();
      s.set_level(before);
      s.require_shines(before, "before the module was closed");
      s.opened.close();
    } else {
      const auto victim = s.opened.start_victim(ShineTask{before});
      const bool so =
          s.waiting.until([&] { return std::abs(s.shines() - before) <= kLevelRoom; }, kShownWithin);
      require(so, "before the module was killed: {} of the full level has to shine, and {} does", before,
              s.shines());
      victim->kill();
    }
    s.waiting.pause(milliseconds(200));
    end == End::closed ? s.opened.open() : s.opened.open_after_kill(s.waiting);
    s.require_true(opened);
    s.waiting.pause(milliseconds(300));
    s.require_true(fmt::format("a while later, {}", opened));
  }
  s.open_shutter();
  s.set_level(1);
  s.require_shines(1, fmt::format("set, {}", opened));
  return {};
}

Outcome closed_while_it_shines(Bench& bench) {
  return ended_while_it_shines(bench, End::closed);
}

Outcome killed_while_it_shines(Bench& bench) {
  return ended_while_it_shines(bench, End::killed);
}

Outcome absent_at_opening(Bench& bench) {
  LightSession s(bench);
  s.opened.close();
  if (!s.wire().cut()) not_proven("this bench cannot cut the wire");
  require_told_or_lost(bench);
  require(s.wire().restore(), "the bench cannot restore the wire that it cut");
  s.opened.open();
  s.recover("opened again with the device back");
  s.require_true("opened again with the device back");
  s.open_shutter();
  s.set_level(1);
  s.require_shines(1, "set with the device back");
  return {};
}

// The spoilt answer comes to a set and to a reading; the truth is told, or an error.
void a_few(LightSession& s, Spoil how, const char* name) {
  double level = s.dim();
  for (int answers = 1; answers <= 3; ++answers) {
    const std::string when = fmt::format("after {} {} answer{}", answers, name, answers == 1 ? "" : "s");
    (void)s.wire().spoil(how, answers);
    level = level > 0.5 ? s.dim() : 1;
    const auto set = s.try_level(level);
    if (set) {
      s.recover(when);
      s.require_shines(level, when);
    } else {
      require(set.error().code == ErrorCode::lost || set.error().code == ErrorCode::device,
              "{}: set_level answered {}; an error of the wire is lost or device", when, told(set.error()));
      s.recover(when);
      s.require_true(when);
    }
    s.open_shutter();
    level = level > 0.5 ? s.dim() : 1;
    s.set_level(level);
    (void)s.wire().spoil(how, answers);
    bool lost = false;
    for (int i = 0; i < 5; ++i) {
      const auto now = s.try_state();
      if (now) {
        require(std::abs(s.claimed(*now) - s.shines()) <= kLevelRoom,
                "{}: state() says that {} of the full level shines, and {} does", when, s.claimed(*now),
                s.shines());
      } else {
        require(now.error().code == ErrorCode::lost || now.error().code == ErrorCode::device,
                "{}: state() answered {}; an error of the wire is lost or device", when, told(now.error()));
        lost = lost || now.error().code == ErrorCode::lost;
      }
    }
    s.recover(when);
    // One that was lost may be as it is at its start.
    lost ? s.require_true(when) : s.require_shines(level, when);
    s.open_shutter();
  }
}

Outcome spoilt_answers(Bench& bench) {
  LightSession s(bench);
  s.open_shutter();
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
    s.open_shutter();
    a_few(s, how, name);
    ++shown;
  }
  if (shown == 0) not_proven("this bench cannot spoil answers");
  if (!not_shown.empty()) not_proven("this bench cannot make answers {}; the others passed", not_shown);
  return {};
}

// Cut, and found to be lost.
void unplug(LightSession& s) {
  if (!s.wire().cut()) not_proven("this bench cannot cut the wire");
  std::string last;
  const bool lost = s.waiting.until(
      [&] {
        const auto now = s.try_state();
        last = now ? "a state" : told(now.error());
        return !now && now.error().code == ErrorCode::lost;
      },
      kLostWithin, milliseconds(50));
  require(lost, "{:.0f} s after the wire was cut state() answers {} instead of lost",
          base::to_seconds(kLostWithin), last);
}

void plug_in(LightSession& s) {
  require(s.wire().restore(), "the bench cannot restore the wire that it cut");
}

// Each question may be answered at its last attempt. A call that finds the device back asks many, and takes
// their sum if nothing bounds it.
Outcome most_missing(Bench& bench) {
  constexpr std::string_view kWhen = "with two of three answers missing";
  constexpr int kForAll = 99'999, kCalls = 3;  // the first two are missing
  // A driver may look for a device that is gone only once in a while.
  constexpr milliseconds kLookedForEvery{1100};
  LightSession s(bench);
  s.open_shutter();
  if (!s.wire().thin_out(0)) not_proven("this bench cannot make two of three answers missing");
  const auto judge = [&](const base::Error& error, std::string_view call) {
    require(error.code == ErrorCode::lost || error.code == ErrorCode::device,
            "{}: {} answered {}; an error of the wire is lost or device", kWhen, call, told(error));
  };
  for (const double level : {s.dim(), 1.0}) {
    unplug(s);
    plug_in(s);
    (void)s.wire().thin_out(kForAll);
    for (int i = 0; i < kCalls; ++i) {
      s.waiting.pause(kLookedForEvery);
      if (const auto set = s.try_level(level); !set) judge(set.error(), "set_level");
      const auto now = s.try_state();
      if (!now) {
        judge(now.error(), "state()");
      } else {
        require(std::abs(s.claimed(*now) - s.shines()) <= kLevelRoom,
                "{}: state() says that {} of the full level shines, and {} does", kWhen, s.claimed(*now),
                s.shines());
      }
    }
    (void)s.wire().thin_out(0);
    s.recover(kWhen);
    s.require_true(kWhen);
    s.open_shutter();
    s.set_level(level);
    s.require_shines(level, "once all answers came again");
  }
  return {};
}

Outcome lost_and_back(Bench& bench) {
  LightSession s(bench);
  s.open_shutter();
  for (int i = 0; i < 2; ++i) {
    s.set_level(1);
    s.require_shines(1, "before it was unplugged");
    unplug(s);
    const auto set = s.try_level(s.dim());
    require(!set && set.error().code == ErrorCode::lost,
            "with the wire cut set_level answered {} instead of lost", set ? "done" : told(set.error()));
    plug_in(s);
    s.recover("lost and back");
    s.require_true("lost and back");
    s.open_shutter();
    s.set_level(s.dim());
    s.require_shines(s.dim(), "set after it was lost and back");
  }
  return {};
}

}  // namespace

std::vector<Check> light_checks() {
  return {{"light: the level shines and is read back", level},
          {"light: the shutter", shutter},
          {"light: closed while it shines and opened again", closed_while_it_shines},
          {"light: killed while it shines and opened again", killed_while_it_shines},
          {"light: spoilt answers", spoilt_answers},
          {"light: most answers missing", most_missing},
          {"light: lost and back", lost_and_back},
          {"light: absent at opening", absent_at_opening}};
}

}  // namespace rig::drivers::conformance
