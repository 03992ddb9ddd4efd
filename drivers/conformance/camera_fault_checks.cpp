// Frames that are damaged or missing, and a camera that is gone.
#include "drivers/conformance/camera_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

// As rigd goes on after a frame that did not come.
void start_anew(CameraSession& s, std::string_view after) {
  must(s.try_abort(), fmt::format("abort {}", after));
  must(s.try_arm(), fmt::format("arm {}", after));
}

// It never comes; and where fetch says why, it says that the frame is at fault, not the camera: any other
// error stops the rig for the night.
void require_spoilt(CameraSession& s, std::string_view when) {
  const auto said = s.require_none(s.longest_s(), when);
  require(!said || said->code == ErrorCode::damaged, "{}, and fetch answered {} instead of damaged", when,
          said ? told(*said) : "");
}

Outcome corrupt_frames(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  for (int i = 0; i < 3; ++i) {
    (void)s.take(s.shortest_s());
    if (!s.peer().corrupt_next()) not_proven("this bench cannot damage a frame");
    s.trigger(s.longest_s());
    require_spoilt(s, "a frame arrived damaged");
    start_anew(s, "after a damaged frame");
    (void)s.take(s.longest_s());
  }
  return {};
}

Outcome missing_frames(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  for (int i = 0; i < 3; ++i) {
    (void)s.take(s.shortest_s());
    if (!s.peer().drop_next()) not_proven("this bench cannot lose a frame");
    s.trigger(s.longest_s());
    require_spoilt(s, "a frame was lost on its way");
    start_anew(s, "after a frame that was lost");
    (void)s.take(s.longest_s());
  }
  return {};
}

void cut(CameraSession& s) {
  if (!s.wire().cut()) not_proven("this bench cannot unplug the camera");
}

// Within a bound a trigger (or the fetch after it) says lost; no frame comes meanwhile.
void require_lost(CameraSession& s, std::string_view when) {
  std::string last = "nothing";
  const bool lost = s.waiting().until(
      [&] {
        const auto frame = s.try_fetch(s.frame().pixels());
        require_always(!frame || !frame->has_value(), "{}: a frame came from a camera that is unplugged",
                       when);
        if (!frame && frame.error().code == ErrorCode::lost) return true;
        const auto triggered = s.try_trigger(s.shortest_s());
        if (!triggered) last = told(triggered.error());
        return !triggered && triggered.error().code == ErrorCode::lost;
      },
      kLostWithin, milliseconds(50));
  require(lost, "{}: {:.0f} s after it was unplugged the camera answers {} instead of lost", when,
          base::to_seconds(kLostWithin), last);
  const auto armed = s.try_arm();
  require(armed || armed.error().code == ErrorCode::lost, "{}: arm of a camera that is unplugged answered {}",
          when, armed ? "" : told(armed.error()));
  (void)s.try_abort();
}

void require_back(CameraSession& s, std::string_view when) {
  require(s.wire().restore(), "the bench cannot plug in the camera that it unplugged");
  std::string last = "nothing";
  const bool back = s.waiting().until(
      [&] {
        (void)s.try_abort();
        auto answer = s.try_arm();
        if (answer) answer = s.try_trigger(s.shortest_s());
        if (!answer) last = told(answer.error());
        return answer.has_value();
      },
      kBackWithin, milliseconds(100));
  require(back, "{}: {:.0f} s after it was plugged in again the camera answers {}", when,
          base::to_seconds(kBackWithin), last);
  must(s.try_abort(), "abort once the camera is back");
  // The whole bracket again.
  must(s.try_arm(), "arm once the camera is back");
  std::optional<std::uint64_t> number;
  for (const double exposure_s : s.test().exposures_s) {
    const FrameInfo info = s.take(exposure_s);
    require(!number || info.counter > *number, "{}: a frame has number {}, the one before it {}", when,
            info.counter, number.value_or(0));
    number = info.counter;
  }
}

Outcome lost_in_a_bracket(Bench& bench) {
  CameraSession s(bench);
  for (int i = 0; i < 2; ++i) {
    s.arm();
    for (std::size_t taken = 0; taken < 3; ++taken) (void)s.take(s.test().exposures_s[taken]);
    cut(s);
    require_lost(s, "lost in the middle of a bracket");
    require_back(s, "lost in the middle of a bracket");
  }
  return {};
}

Outcome lost_while_exposing(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  (void)s.take(s.shortest_s());
  s.trigger(s.longest_s());
  cut(s);
  require_lost(s, "lost while exposing");
  s.require_none(s.longest_s(), "lost while exposing");
  require_back(s, "lost while exposing");
  return {};
}

// Ready after an opening, as rigd asks until it is.
void arm_once_it_can(CameraSession& s, std::string_view when) {
  base::Result<void> armed;
  (void)s.waiting().until(
      [&] {
        armed = s.try_arm();
        return armed.has_value();
      },
      kBackWithin, milliseconds(50));
  must(armed, fmt::format("arm {}", when));
}

Outcome ended_while_exposing(Bench& bench, End end) {
  const char* const opened = end == End::closed ? "opened again" : "opened after it was killed";
  CameraSession s(bench);
  s.arm();
  (void)s.take(s.shortest_s());
  s.end_while_exposing(end, s.longest_s());
  s.open_after(end);
  s.require_none(s.longest_s(), fmt::format("{}, and nothing triggered", opened));
  arm_once_it_can(s, opened);
  (void)s.take(s.shortest_s());
  (void)s.take(s.longest_s());
  // And triggered at once: the frame is of that trigger.
  s.end_while_exposing(end, s.longest_s());
  s.open_after(end);
  arm_once_it_can(s, opened);
  (void)s.take(s.shortest_s());
  (void)s.take(s.longest_s());
  return {};
}

Outcome closed_while_exposing(Bench& bench) {
  return ended_while_exposing(bench, End::closed);
}

Outcome killed_while_exposing(Bench& bench) {
  return ended_while_exposing(bench, End::killed);
}

Outcome absent_at_opening(Bench& bench) {
  CameraSession s(bench);
  s.close();
  cut(s);
  require_told_or_lost(bench);
  require(s.wire().restore(), "the bench cannot plug in the camera that it unplugged");
  s.open();
  arm_once_it_can(s, "opened again with the camera back");
  (void)s.take(s.shortest_s());
  (void)s.take(s.longest_s());
  return {};
}

}  // namespace

std::vector<Check> camera_fault_checks() {
  return {{"camera: corrupt frames are detected", corrupt_frames},
          {"camera: missing frames are detected", missing_frames},
          {"camera: lost in the middle of a bracket and back", lost_in_a_bracket},
          {"camera: lost while exposing and back", lost_while_exposing},
          {"camera: absent at opening", absent_at_opening},
          {"camera: closed while exposing and opened again", closed_while_exposing},
          {"camera: killed while exposing and opened again", killed_while_exposing}};
}

}  // namespace rig::drivers::conformance
