// Frames: each is the one that was asked for, whole, and in its place.
#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/conformance/camera_session.h"
#include "drivers/conformance/check_lists.h"

namespace rig::drivers::conformance {

namespace {

using base::ErrorCode;
using base::seconds;

Outcome capabilities_are_true(Bench& bench) {
  CameraSession s(bench);
  const CameraCapabilities& c = s.capabilities();
  constexpr std::array kPatterns{"none", "RGGB", "BGGR", "GRBG", "GBRG"};
  require(c.bits >= 1 && c.bits <= 16, "samples have {} bits", c.bits);
  require(std::find(kPatterns.begin(), kPatterns.end(), c.bayer) != kPatterns.end(),
          "the Bayer pattern is '{}'", c.bayer);
  require(c.min_exposure_s > 0 && c.min_exposure_s <= c.max_exposure_s, "exposures are from {} to {} s",
          c.min_exposure_s, c.max_exposure_s);
  require(c.readout_s >= 0, "the readout takes {} s", c.readout_s);
  require(s.shortest_s() >= c.min_exposure_s && s.longest_s() <= c.max_exposure_s,
          "the bench exposes from {} to {} s, the camera says from {} to {} s", s.shortest_s(), s.longest_s(),
          c.min_exposure_s, c.max_exposure_s);
  s.arm();
  // Every sample is written, and none has bits that the sensor has not: the buffer is filled with two values
  // that no sample has in common.
  std::vector<bool> written(s.size());
  for (const std::uint16_t fill : {std::uint16_t{0xFFFF}, std::uint16_t{0}}) {
    auto pixels = s.frame().pixels();
    std::fill(pixels.begin(), pixels.end(), fill);
    (void)s.take(s.longest_s());
    const unsigned most = (1U << static_cast<unsigned>(c.bits)) - 1;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (pixels[i] != fill) written[i] = true;
      require(pixels[i] <= most, "sample {} is {}, more than {} bits hold", i, pixels[i], c.bits);
    }
  }
  const auto missed = static_cast<std::size_t>(std::count(written.begin(), written.end(), false));
  require(missed == 0, "{} of {} samples were not written", missed, s.size());
  // Asked while it exposes, as rigd does.
  s.trigger(s.longest_s());
  const auto warm =
      timed(s.clock(), kCameraCall, "temperature_c", [&] { return s.camera().temperature_c(); });
  require(warm.has_value(), "temperature_c while exposing answered {}", warm ? "" : told(warm.error()));
  (void)s.wait_for_frame(s.longest_s());
  return {};
}

Outcome exposure_as_asked(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  for (const double exposure_s : s.test().exposures_s) (void)s.take(exposure_s);
  return s.proven_by_pixels();
}

Outcome bracket_of_eight(Bench& bench) {
  CameraSession s(bench);
  for (int brackets = 0; brackets < 2; ++brackets) {
    s.arm();
    std::vector<double> taken;
    std::uint64_t last = 0;
    for (const double exposure_s : s.test().exposures_s) {
      const FrameInfo info = s.take(exposure_s);
      require(taken.empty() || info.counter > last,
              "frame {} of the bracket has number {}, the one before it {}", taken.size() + 1, info.counter,
              last);
      last = info.counter;
      taken.push_back(info.exposure_s);
    }
    std::sort(taken.begin(), taken.end());
    require(std::adjacent_find(taken.begin(), taken.end()) == taken.end(),
            "eight different exposures were asked for, and two frames say the same");
  }
  return s.proven_by_pixels();
}

Outcome frames_are_counted(Bench& bench) {
  CameraSession s(bench);
  std::optional<std::uint64_t> last;
  for (int i = 0; i < 12; ++i) {
    if (i % 4 == 0) s.arm();
    if (i == 6) {
      s.trigger(s.shortest_s());
      must(s.try_abort(), "abort");
    }
    const FrameInfo info = s.take(s.shortest_s());
    require(!last || info.counter > *last, "a frame has number {}, the one before it {}", info.counter,
            last.value_or(0));
    last = info.counter;
  }
  return {};
}

// The shortest and the longest exposure in turns, each triggered the moment the frame before it is there: a
// frame of the setting before would tell.
Outcome none_from_before(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  for (int i = 0; i < 10; ++i) (void)s.take(i % 2 == 0 ? s.shortest_s() : s.longest_s());
  // And after an exposure was aborted, and after one whose frame nobody fetched.
  s.trigger(s.longest_s());
  must(s.try_abort(), "abort");
  (void)s.take(s.shortest_s());
  s.trigger(s.shortest_s());
  s.waiting().pause(seconds(s.shortest_s()) + s.test().frame_within / 2);
  s.arm();
  const auto old = s.try_fetch(s.frame().pixels());
  require_always(!old || !old->has_value(), "after arm() the frame of an older bracket was delivered");
  (void)s.take(s.longest_s());
  return s.proven_by_pixels();
}

Outcome trigger_while_exposing(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  for (int i = 0; i < 3; ++i) {
    const base::Time triggered = s.waiting().now();
    s.trigger(s.longest_s());
    const auto second = s.try_trigger(s.shortest_s());
    require(!second, "a trigger while it exposes was accepted");
    require(second.error().code == ErrorCode::busy || second.error().code == ErrorCode::refused,
            "a trigger while it exposes answered {} instead of busy or refused", told(second.error()));
    const FrameInfo info = s.wait_for_frame(s.longest_s());
    s.require_own(info, s.longest_s(), triggered);
  }
  const auto more = s.try_fetch(s.frame().pixels());
  require_always(!more || !more->has_value(), "a frame came that nobody triggered");
  (void)s.take(s.shortest_s());
  return {};
}

Outcome abort_of_an_exposure(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  must(s.try_abort(), "abort at rest");
  s.trigger(s.longest_s());
  must(s.try_abort(), "abort while exposing");
  s.require_none(s.longest_s(), "after an abort");
  (void)s.take(s.shortest_s());
  // Once it has been exposed and waits to be fetched, too.
  s.trigger(s.shortest_s());
  s.waiting().pause(seconds(s.shortest_s()) + s.test().frame_within / 2);
  must(s.try_abort(), "abort of a frame that nobody fetched");
  s.require_none(s.shortest_s(), "after an abort of a frame that nobody fetched");
  (void)s.take(s.longest_s());
  return {};
}

Outcome buffer_is_not_overrun(Bench& bench) {
  CameraSession s(bench);
  s.arm();
  // wait_for_frame looks at the words around the buffer after each fetch.
  (void)s.take(s.shortest_s());
  s.trigger(s.shortest_s());
  s.waiting().pause(seconds(s.shortest_s()) + s.test().frame_within / 2);
  auto pixels = s.frame().pixels();
  for (const std::size_t less : {std::size_t{1}, s.size() / 2, s.size()}) {
    constexpr std::uint16_t kUntouched = 0x5A3C;
    std::fill(pixels.begin(), pixels.end(), kUntouched);
    const auto answer = s.try_fetch(pixels.first(s.size() - less));
    require_always(!answer, "fetch into a buffer that is {} samples too small {}", less,
                   answer && answer->has_value() ? "delivered a frame" : "was no error");
    require_always(
        std::all_of(pixels.begin(), pixels.end(), [](std::uint16_t word) { return word == kUntouched; }),
        "fetch into a buffer that is {} samples too small wrote into it or beyond it", less);
  }
  must(s.try_abort(), "abort");
  s.arm();
  (void)s.take(s.shortest_s());
  return {};
}

}  // namespace

std::vector<Check> camera_frame_checks() {
  return {{"camera: capabilities are true", capabilities_are_true},
          {"camera: exposure as asked and as reported", exposure_as_asked},
          {"camera: a bracket of eight", bracket_of_eight},
          {"camera: frames are counted", frames_are_counted},
          {"camera: none from before the setting took effect", none_from_before},
          {"camera: a trigger while exposing", trigger_while_exposing},
          {"camera: abort of an exposure", abort_of_an_exposure},
          {"camera: the buffer is never overrun", buffer_is_not_overrun}};
}

}  // namespace rig::drivers::conformance
