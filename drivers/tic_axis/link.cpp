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

// Says of which command an error came.
template <typename T>
Result<T> naming(Command command, Result<T> answer) {
  if (!answer) answer.error().what = fmt::format("'{}': {}", name_of(command), answer.error().what);
  return answer;
}

}  // namespace

Result<void> Link::out(Command command, std::uint16_t value, std::uint16_t index, const RetryPolicy& policy) {
  const ControlRequest request{kVendorOut, static_cast<std::uint8_t>(command), value, index};
  return naming(command, with_retries(policy, [&] {
                  const std::lock_guard lock(turn_);
                  return noting(transport_->control_out(request, policy.answer));
                }));
}

Result<Bytes> Link::in(Command command, std::uint16_t offset, std::uint16_t length) {
  const ControlRequest request{kVendorIn, static_cast<std::uint8_t>(command), 0, offset};
  const std::lock_guard lock(turn_);
  auto got = noting(transport_->control_in(request, length, policy_.answer));
  if (got && got->size() != length) {
    return fail(ErrorCode::damaged, fmt::format("{} of {} bytes", got->size(), length), identity().where);
  }
  return got;
}

Result<void> Link::quick_once(Command command) {
  return out(command, 0, 0, RetryPolicy{1, std::min(policy_.answer, kAtOnce)});
}

Result<void> Link::quick(Command command) {
  return out(command, 0, 0, policy_);
}

Result<void> Link::write7(Command command, std::uint8_t value) {
  return out(command, value, 0, policy_);
}

Result<void> Link::write32(Command command, std::int64_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return out(command, static_cast<std::uint16_t>(bits & 0xFFFFU), static_cast<std::uint16_t>(bits >> 16U),
             policy_);
}

Result<void> Link::set_setting(std::uint16_t offset, std::uint8_t value) {
  return out(Command::set_setting, value, offset, policy_);
}

Result<Variables> Link::variables() {
  return naming(Command::get_variable, with_retries(policy_, [&]() -> Result<Variables> {
                  auto block = in(Command::get_variable, 0, kVariableBytes);
                  if (!block) return pass(block);
                  return decode_variables(*block);
                }));
}

Result<Settings> Link::settings() {
  return naming(Command::get_setting, with_retries(policy_, [&]() -> Result<Settings> {
                  auto block = in(Command::get_setting, 0, kSettingBytes);
                  if (!block) return pass(block);
                  return decode_settings(*block);
                }));
}

Result<std::uint32_t> Link::take_errors_occurred() {
  constexpr Command kTake = Command::get_variable_and_clear_errors;
  return naming(kTake, with_retries(policy_, [&]() -> Result<std::uint32_t> {
                  auto bytes = in(kTake, kErrorsOccurredAt, kErrorsOccurredBytes);
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
