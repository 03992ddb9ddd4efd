// Whatever comes over a 6000 controller's line: it is cut into the same replies however it arrives, none of
// them longer than a line may be; status and numbers are read whole or not at all.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "drivers/sixk_axis/reply.h"

namespace {

using rig::drivers::sixk::Reply;
using rig::drivers::sixk::ReplyReader;

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

void look_at(std::string_view text) {
  using namespace rig::drivers::sixk;
  const auto number = number_in(text);
  if (number && !std::isfinite(*number)) std::abort();
  if (const auto status = status_in(text)) {
    std::size_t bits = 0;
    for (const char c : text) bits += c != '_' ? 1U : 0U;
    if (bits != 32) std::abort();
    (void)fault_of(*status);
  }
}

}  // namespace

// The first byte says into how long pieces the rest is cut, and of which axis an answer is expected.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto whole = read(bytes, bytes.size() + 1);
  if (whole.size() > bytes.size()) std::abort();
  if (read(bytes, 1U + data[0] % 16U) != whole) std::abort();
  const int axis = data[0] >> 5U;
  for (const Reply& reply : whole) {
    if (reply.text.size() > kLongestText) std::abort();
    for (const std::string_view name : {"TAS", "TPM", "TREV", "A"}) {
      for (const bool nameless : {false, true}) {
        const auto value = rig::drivers::sixk::value_in(reply.text, axis, name, nameless);
        if (value && value->size() > reply.text.size()) std::abort();
        if (value) look_at(*value);
      }
    }
    look_at(reply.text);
  }
  return 0;
}
