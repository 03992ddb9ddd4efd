#include "drivers/aravis_camera/frame_judge.h"

#include <cmath>
#include <fmt/format.h>

namespace rig::drivers::aravis {

namespace {

// A camera states its exposure in its own steps, a line's readout at most; another setting of a bracket is
// farther off.
constexpr double kExposureShare = 0.02;
constexpr double kExposureStep_s = 50e-6;
// What was exposed for an earlier trigger is not older. A camera that is further off counts its frames' time
// by another clock than the one that it latches.
constexpr double kOldest_s = 60;
constexpr std::uint64_t kLastShortId = 65535;

Judgement bad(std::string why) {
  return {Verdict::bad, std::move(why)};
}

Judgement spoilt(std::string why) {
  return {Verdict::spoilt, std::move(why)};
}

bool is_same_exposure(double set_s, double did_s) {
  return std::abs(set_s - did_s) <= std::max(kExposureShare * set_s, std::min(kExposureStep_s, set_s / 4));
}

bool began_before(const BufferFacts& facts, double clock_error_s) {
  return facts.before_trigger_s && *facts.before_trigger_s > clock_error_s &&
         *facts.before_trigger_s <= kOldest_s;
}

}  // namespace

bool follows(std::uint64_t last, std::uint64_t id) {
  return id == last + 1 || (last == kLastShortId && id == 1);
}

Judgement judge(const Expected& expected, const BufferFacts& facts) {
  if (!facts.damage.empty()) return spoilt("the frame is damaged: " + facts.damage);
  if (expected.not_before_ns && facts.taken_ns < *expected.not_before_ns) return {Verdict::old, {}};
  if (began_before(facts, expected.clock_error_s)) return {Verdict::old, {}};
  if (!facts.is_image) return bad("the camera sent something that is no image");
  if (facts.format != expected.format) {
    return bad(
        fmt::format("the frame has pixel format 0x{:08x}, set was 0x{:08x}", facts.format, expected.format));
  }
  if (facts.width != expected.width || facts.height != expected.height ||
      facts.offset_x != expected.offset_x || facts.offset_y != expected.offset_y) {
    return bad(fmt::format("the frame shows {} x {} pixels at ({}, {}), set were {} x {} at ({}, {})",
                           facts.width, facts.height, facts.offset_x, facts.offset_y, expected.width,
                           expected.height, expected.offset_x, expected.offset_y));
  }
  if (facts.line_padding != 0) {
    return bad(
        fmt::format("the frame has {} bytes between its lines; choose a width without", facts.line_padding));
  }
  if (facts.bytes < expected.image_bytes || facts.bytes > expected.payload_bytes) {
    return spoilt(fmt::format("the frame is damaged: {} bytes came of an image of {}", facts.bytes,
                              expected.image_bytes));
  }
  if (expected.last_id && !follows(*expected.last_id, facts.frame_id)) {
    return spoilt(fmt::format(
        "frame {} follows frame {}: the camera took frames that were not asked for, or one was lost",
        facts.frame_id, *expected.last_id));
  }
  if (facts.exposure_s && !is_same_exposure(expected.exposure_s, *facts.exposure_s)) {
    return spoilt(fmt::format("the frame was exposed for {} us, set were {} us", *facts.exposure_s * 1e6,
                              expected.exposure_s * 1e6));
  }
  return {};
}

}  // namespace rig::drivers::aravis
