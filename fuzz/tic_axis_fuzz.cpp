// Whatever a Tic answers: its blocks are read as something that a Tic can be, or are said to be garbled.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "drivers/tic_axis/products.h"
#include "drivers/tic_axis/protocol.h"

namespace {

using namespace rig::drivers::tic;

void read_as_variables(const std::vector<std::uint8_t>& block) {
  const auto v = decode_variables(block);
  if (!v) {
    if (v.error().code != rig::base::ErrorCode::damaged || v.error().what.empty()) std::abort();
    return;
  }
  if (v->max_speed > kMostSpeed || std::abs(std::int64_t{v->velocity}) > kMostSpeed) std::abort();
  if (!microsteps(v->step_mode)) std::abort();
  if (name_of(v->operation)[0] == 'u') std::abort();  // "unknown"
  if (error_text(v->errors_occurred).empty() != (v->errors_occurred == 0)) std::abort();
  if (current_ma(Product::t500, v->current_limit) < 0) std::abort();
}

void read_as_settings(const std::vector<std::uint8_t>& block) {
  const auto s = decode_settings(block);
  if (!s && (s.error().code != rig::base::ErrorCode::damaged || s.error().what.empty())) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> block(data, data + size);
  read_as_variables(block);
  read_as_settings(block);
  // And as long as they have to be.
  block.resize(kVariableBytes);
  read_as_variables(block);
  block.assign(data, data + size);
  block.resize(kSettingBytes);
  read_as_settings(block);
  return 0;
}
