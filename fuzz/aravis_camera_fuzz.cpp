// Whatever bytes a camera sends as an image, and whatever it says about them: samples are unpacked within
// their buffers and have no more bits than their format, and a frame is good only where all of it came.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "drivers/aravis_camera/frame_judge.h"
#include "drivers/aravis_camera/pixel_format.h"

namespace {

using namespace rig::drivers::aravis;

constexpr std::size_t kHead = 4;

void unpack_some(const std::uint8_t* data, std::size_t size) {
  const auto& formats = pixel_formats();
  const PixelFormat& format = formats[data[0] % formats.size()];
  const int shift = format.bits == 16 ? data[1] % 9 : 0;
  const std::size_t count = data[2] | (static_cast<std::size_t>(data[3] & 0x0f) << 8);
  // On the heap, exactly as large as needed: the sanitizer sees a byte too many.
  const std::vector<std::uint8_t> bytes(data + kHead, data + size);
  std::vector<std::uint16_t> samples(count, 0);
  const bool done = unpack(format.packing, shift, bytes, samples).has_value();
  if (done != (bytes.size() >= bytes_of(format.packing, count))) std::abort();
  for (const std::uint16_t sample : samples) {
    if (sample >> (format.bits - shift) != 0) {
      // Words are handed on as they came: rigd looks for bits that the sensor has not.
      if (format.packing != Packing::words) std::abort();
    }
  }
}

void judge_some(const std::uint8_t* data, std::size_t size) {
  BufferFacts facts;
  struct {
    std::uint64_t id;
    std::uint32_t format;
    std::int32_t x, y, width, height, padding;
    std::uint64_t bytes;
    std::int64_t taken_ns;
    double exposure_s;
    std::uint8_t is_image, has_exposure;
  } raw{};
  std::memcpy(&raw, data, std::min(size, sizeof raw));
  // No bytes at all are a good frame; each bit of them spoils it somewhere.
  facts.is_image = raw.is_image % 4 == 0;
  facts.frame_id = raw.id ^ 7U;
  facts.format = raw.format ^ 0x01100007U;
  facts.offset_x = raw.x;
  facts.offset_y = raw.y;
  facts.width = raw.width ^ 4;
  facts.height = raw.height ^ 2;
  facts.line_padding = raw.padding;
  facts.bytes = raw.bytes ^ 16U;
  facts.taken_ns = raw.taken_ns;
  if (raw.has_exposure % 2 != 0) facts.exposure_s = raw.exposure_s;
  Expected expected;
  expected.format = 0x01100007;
  expected.width = 4;
  expected.height = 2;
  expected.image_bytes = 16;
  expected.payload_bytes = 64;
  expected.exposure_s = 1e-3;
  if (raw.is_image % 2 == 0) expected.last_id = 6;
  const Judgement judgement = judge(expected, facts);
  if ((judgement.verdict == Verdict::bad || judgement.verdict == Verdict::spoilt) && judgement.why.empty())
    std::abort();
  if (judgement.verdict != Verdict::good) return;
  const bool whole = facts.is_image && facts.width == 4 && facts.height == 2 && facts.bytes >= 16 &&
                     facts.bytes <= 64 && facts.format == expected.format && facts.line_padding == 0;
  if (!whole) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < kHead) return 0;
  unpack_some(data, size);
  judge_some(data, size);
  return 0;
}
