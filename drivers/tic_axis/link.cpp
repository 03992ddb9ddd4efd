#include "drivers/tic_axis/link.h"

#include <algorithm>

namespace rig::drivers::tic {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Bytes = std::vector<std::uint8_t>;

namespace {

constexpr std::uint8_t kVendorOut = 0x40, kVendorIn = 0xC0;
// A Tic answers within a millisecond or two.
constexpr std::chrono::milliseconds kAtOnce{50};
constexpr std::uint16_t kErrorsOccurredAt = 0x04, kErrorsOccurredBytes = 4;

// The lock may have been waited for meanwhile.
std::chrono::milliseconds left_until(Deadline answer_by) {
  return std::max(std::chrono::ceil<std::chrono::milliseconds>(answer_by - std::chrono::steady_clock::now()),
                  std::chrono::milliseconds(1));
}

// Says of which command an error came.
template <typename T>
Result<T> naming(Command command, Result<T> answer) {
  if (!answer) answer.error().what = fmt::format("'{}': {}", name_of(command), answer.error().what);
  return answer;
}

}  // namespace

Result<void> Link::out(Command command, std::uint16_t value, std::uint16_t index, const RetryPolicy& policy,
                       Deadline ends) {
  const ControlRequest request{kVendorOut, static_cast<std::uint8_t>(command), value, index};
  return naming(command, with_retries(policy, ends, identity().where, [&](Deadline answer_by) {
                  const std::lock_guard lock(turn_);
                  return noting(transport_->control_out(request, left_until(answer_by)));
                }));
}

Result<void> Link::out(Command command, std::uint16_t value, std::uint16_t index) {
  return out(command, value, index, policy_, stop_ ? policy_.stop_ends(call_ends_) : call_ends_);
}

Result<Bytes> Link::in(Command command, std::uint16_t offset, std::uint16_t length, Deadline answer_by) {
  const ControlRequest request{kVendorIn, static_cast<std::uint8_t>(command), 0, offset};
  const std::lock_guard lock(turn_);
  auto got = noting(transport_->control_in(request, length, left_until(answer_by)));
  if (got && got->size() != length) {
    return fail(ErrorCode::damaged, fmt::format("{} of {} bytes", got->size(), length), identity().where);
  }
  return got;
}

Result<void> Link::quick_once(Command command) {
  return out(command, 0, 0, RetryPolicy{1, std::min(policy_.answer, kAtOnce)}, Deadline::max());
}

Result<void> Link::quick(Command command) {
  return out(command, 0, 0);
}

Result<void> Link::write7(Command command, std::uint8_t value) {
  return out(command, value, 0);
}

Result<void> Link::write32(Command command, std::int64_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return out(command, static_cast<std::uint16_t>(bits & 0xFFFFU), static_cast<std::uint16_t>(bits >> 16U));
}

Result<void> Link::set_setting(std::uint16_t offset, std::uint8_t value) {
  return out(Command::set_setting, value, offset);
}

Result<Variables> Link::variables() {
  return naming(
      Command::get_variable,
      with_retries(policy_, call_ends_, identity().where, [&](Deadline answer_by) -> Result<Variables> {
        auto block = in(Command::get_variable, 0, kVariableBytes, answer_by);
        if (!block) return pass(block);
        return decode_variables(*block);
      }));
}

Result<Settings> Link::settings() {
  return naming(
      Command::get_setting,
      with_retries(policy_, call_ends_, identity().where, [&](Deadline answer_by) -> Result<Settings> {
        auto block = in(Command::get_setting, 0, kSettingBytes, answer_by);
        if (!block) return pass(block);
        return decode_settings(*block);
      }));
}

Result<std::uint32_t> Link::take_errors_occurred() {
  constexpr Command kTake = Command::get_variable_and_clear_errors;
  return naming(
      kTake,
      with_retries(policy_, call_ends_, identity().where, [&](Deadline answer_by) -> Result<std::uint32_t> {
        auto bytes = in(kTake, kErrorsOccurredAt, kErrorsOccurredBytes, answer_by);
        if (!bytes) return pass(bytes);
        std::uint32_t errors = 0;
        for (std::size_t i = 0; i < kErrorsOccurredBytes; ++i) {
          errors |= static_cast<std::uint32_t>((*bytes)[i]) << (8 * i);
        }
        return errors;
      }));
}

Result<void> Link::feed() {
  return quick_once(Command::reset_command_timeout);
}

}  // namespace rig::drivers::tic
