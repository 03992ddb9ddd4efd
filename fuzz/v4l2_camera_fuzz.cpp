// Whatever a video device says of its frames and its controls: samples are unpacked within their buffers and
// have no more bits than their format, a frame that may be of an older setting is none, and a control's value
// is within what it takes.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "drivers/v4l2_camera/controls.h"
#include "drivers/v4l2_camera/frame_sieve.h"
#include "drivers/v4l2_camera/pixel_format.h"
#include "drivers/v4l2_camera/settling.h"

namespace {

using namespace rig::drivers::v4l2;
using Bytes = std::span<const std::uint8_t>;

template <typename T>
T taken(Bytes& bytes) {
  T value{};
  const std::size_t size = std::min(sizeof value, bytes.size());
  std::memcpy(&value, bytes.data(), size);
  bytes = bytes.subspan(size);
  return value;
}

void unpack_some(Bytes bytes) {
  const auto& formats = pixel_formats();
  const PixelFormat& format = formats[taken<std::uint8_t>(bytes) % formats.size()];
  const int shift = format.bits == 16 ? taken<std::uint8_t>(bytes) % 9 : 0;
  const Layout layout{taken<std::uint8_t>(bytes), taken<std::uint8_t>(bytes), taken<std::uint16_t>(bytes)};
  // On the heap, exactly as large as they are: the sanitizer sees a byte too many.
  const std::vector<std::uint8_t> image(bytes.begin(), bytes.end());
  std::vector<std::uint16_t> samples(layout.width * layout.height, 0);
  const std::size_t needed = image_bytes(format.packing, layout);
  const bool done = unpack(format.packing, shift, layout, image, samples).has_value();
  if (done != (needed != 0 && image.size() >= needed)) std::abort();
  if (!done) return;
  for (const std::uint16_t sample : samples) {
    // Words are handed on as they came: rigd looks for bits that the sensor has not.
    if (format.packing != Packing::words && sample >> format.bits != 0) std::abort();
  }
  const double level = mean_level(format.packing, layout, image);
  if (!(level >= 0 && level <= 65535)) std::abort();
}

void sieve_some(Bytes bytes) {
  constexpr std::size_t kImage = 100;
  constexpr double kInterval_s = 0.01;
  FrameSieve sieve(kImage, kInterval_s);
  std::int64_t set_ns = 0, triggered_ns = 0;
  int settle = 0, whole = 0;
  while (bytes.size() > 8) {
    const auto what = taken<std::uint8_t>(bytes);
    const auto at_ns = std::int64_t{taken<std::uint32_t>(bytes)} * 1000;
    if (what % 8 == 0) {
      settle = what / 8;
      whole = 0;
      set_ns = at_ns;
      sieve.set(at_ns, taken<std::uint16_t>(bytes) * 1e-6, settle);
    } else if (what % 8 == 1) {
      triggered_ns = at_ns;
      sieve.trigger(at_ns);
    } else {
      FrameFacts facts;
      facts.damaged = what % 8 == 2;
      facts.monotonic = what % 8 != 3;
      facts.stamp_is_start = (what & 0x80) != 0;
      facts.bytes = taken<std::uint8_t>(bytes);
      facts.sequence = taken<std::uint32_t>(bytes);
      facts.stamp_ns = at_ns;
      const bool is_new = sieve.earliest_ns(facts) >= set_ns;
      const Judgement judgement = sieve.look(facts);
      if (judgement.verdict == Verdict::bad && judgement.why.empty()) std::abort();
      if (judgement.verdict == Verdict::good) {
        if (facts.damaged || !facts.monotonic || facts.bytes < kImage || !is_new || whole < settle)
          std::abort();
        if (sieve.earliest_ns(facts) < triggered_ns) std::abort();
      }
      if (judgement.verdict == Verdict::settling) ++whole;
    }
  }
}

void read_some_control(Bytes bytes) {
  const auto said = taken<v4l2_queryctrl>(bytes);
  const Control control = read_control(said);
  if (control.min > control.max || control.step < 1 || control.name.size() > sizeof said.name) std::abort();
  const auto wanted = taken<double>(bytes);
  const std::int32_t value = control.nearest(wanted);
  if (value < control.min || value > control.max) std::abort();
}

void settle_some(Bytes bytes) {
  std::vector<double> levels(bytes.begin(), bytes.end());
  const auto settled = settled_at(levels.empty() ? 0 : levels.front(), levels, 2.5);
  if (settled && (*settled < 0 || *settled >= static_cast<int>(levels.size()))) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  unpack_some(bytes);
  sieve_some(bytes);
  read_some_control(bytes);
  settle_some(bytes);
  return 0;
}
