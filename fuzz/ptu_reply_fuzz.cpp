// Whatever comes over a pan-tilt unit's line: it is cut into the same replies however it arrives, none of
// them longer than a line may be, and their values are numbers.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "drivers/ptu_axis/reply.h"

namespace {

using rig::drivers::ptu::Reply;
using rig::drivers::ptu::ReplyReader;

constexpr std::size_t kLongestText = 256;

std::vector<Reply> read(std::string_view bytes, std::size_t piece) {
  ReplyReader reader;
  std::vector<Reply> replies;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    reader.feed(bytes.substr(at, piece));
    while (auto reply = reader.next()) replies.push_back(std::move(*reply));
  }
  return replies;
}

}  // namespace

// The first byte says into how long pieces the rest is cut.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto whole = read(bytes, bytes.size() + 1);
  if (whole.size() > bytes.size()) std::abort();
  if (read(bytes, 1U + data[0] % 16U) != whole) std::abort();
  for (const Reply& reply : whole) {
    if (reply.text.size() > kLongestText || reply.before.size() > kLongestText) std::abort();
    const auto number = rig::drivers::ptu::number_in(reply.text);
    if (number && !std::isfinite(*number)) std::abort();
    if (rig::drivers::ptu::is_terse(reply.text) && !number) std::abort();
    if (rig::drivers::ptu::is_terse(reply.text) && rig::drivers::ptu::is_wordy(reply.text)) std::abort();
    const auto temperature = rig::drivers::ptu::temperature_c_in(reply.text);
    if (temperature && !std::isfinite(*temperature)) std::abort();
  }
  return 0;
}
