#include "drivers/ptu_axis/link.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "drivers/common/printable.h"

namespace rig::drivers::ptu {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

bool is_resolution(std::string_view command) {
  return command == "PR" || command == "TR";
}

bool is_echo_of(std::string_view before, std::string_view command) {
  return !before.empty() &&
         std::equal(before.begin(), before.end(), command.begin(), command.end(), [](char a, char b) {
           return std::toupper(static_cast<unsigned char>(a)) == std::toupper(static_cast<unsigned char>(b));
         });
}

}  // namespace

tl::unexpected<base::Error> Link::silence(std::string_view command) {
  in_step_ = false;
  return fail(
      ErrorCode::timeout,
      fmt::format("the pan-tilt unit does not answer '{}' within {} ms", command, retry_.answer.count()),
      path(), "is it switched on, and the baud rate right?");
}

tl::unexpected<base::Error> Link::garbled(std::string_view command, std::string_view reply) {
  in_step_ = false;
  return fail(ErrorCode::damaged,
              fmt::format("'{}' is no answer of the pan-tilt unit to '{}'", printable(reply), command),
              path(), "look at the cable, its shield and the baud rate");
}

tl::unexpected<base::Error> Link::restarted() const {
  return fail(ErrorCode::lost, "the pan-tilt unit has been switched off and on", path());
}

tl::unexpected<base::Error> Link::refusal(std::string_view command, const Reply& reply) const {
  return fail(ErrorCode::device,
              fmt::format("the pan-tilt unit refuses '{}': {}", command, printable(reply.text)), path());
}

Result<void> Link::write(std::string_view command) {
  return stream_.write(std::string(command) + ' ', retry_.answer);
}

// The next answer; what is none is noted on the way. Nothing: none came by the deadline.
Result<std::optional<Reply>> Link::next(std::string_view command, Time deadline) {
  while (true) {
    auto reply = stream_.next(deadline);
    if (!reply || !*reply) return reply;
    switch ((*reply)->kind) {
      case Reply::Kind::limit:
        ((*reply)->text == "P" ? pan_hit_ : tilt_hit_) = true;
        continue;
      case Reply::Kind::banner:
        if (terse_) return restarted();
        continue;
      case Reply::Kind::noise:
        // Before it is told not to, the unit echoes.
        if (!terse_) continue;
        return garbled(command, (*reply)->text);
      case Reply::Kind::fine:
      case Reply::Kind::error:
        break;
    }
    if (terse_ && is_echo_of((*reply)->before, command)) return restarted();
    return reply;
  }
}

// Takes what has come since; an answer among it is one that nobody waits for any more.
Result<void> Link::look_about() {
  constexpr int kMost = 200;
  for (int i = 0; i < kMost; ++i) {
    auto reply = next({}, Time{});
    if (!reply && reply.error().code != ErrorCode::damaged) return pass(reply);
    if (reply && !*reply) return {};
    in_step_ = false;
  }
  return fail(ErrorCode::damaged, "the line never falls silent", path(), "is it a pan-tilt unit's?");
}

Result<void> Link::fall_into_step(Time deadline) {
  if (in_step_ || marker_.empty()) return {};
  if (auto ok = write(marker_query_); !ok) return ok;
  do {
    auto reply = next(marker_query_, deadline);
    if (!reply && reply.error().code != ErrorCode::damaged) return pass(reply);
    if (!reply) continue;
    if (!*reply) break;
    if ((*reply)->kind == Reply::Kind::fine && (*reply)->text == marker_) {
      in_step_ = true;
      return {};
    }
  } while (std::chrono::steady_clock::now() < deadline);
  return silence(marker_query_);
}

Result<Reply> Link::exchange(std::string_view command, Time deadline) {
  if (auto ok = look_about(); !ok) return pass(ok);
  if (auto ok = fall_into_step(deadline); !ok) return pass(ok);
  if (auto ok = write(command); !ok) return pass(ok);
  do {
    auto reply = next(command, deadline);
    if (!reply) return pass(reply);
    if (!*reply) break;
    // A marker's reply that came late; but one that looks like a position may be one.
    const bool marker =
        !is_resolution(command) && (*reply)->text == marker_ && marker_.find('.') != std::string::npos;
    if (marker) continue;
    // Half an answer, or noise: what follows it need not be whole.
    if (terse_ && !(*reply)->before.empty()) return garbled(command, (*reply)->before);
    return std::move(**reply);
  } while (std::chrono::steady_clock::now() < deadline);
  return silence(command);
}

Result<double> Link::number(std::string_view query) {
  return with_retries(retry_, call_ends_, path(), [&](Time deadline) -> Result<double> {
    auto reply = exchange(query, deadline);
    if (!reply) return pass(reply);
    if (reply->kind == Reply::Kind::error) return refusal(query, *reply);
    if (terse_ && is_wordy(reply->text)) return restarted();
    const auto number = number_in(reply->text);
    if (!number || (terse_ && !is_terse(reply->text))) return garbled(query, reply->text);
    return *number;
  });
}

Result<std::string> Link::text(std::string_view query) {
  return with_retries(retry_, call_ends_, path(), [&](Time deadline) -> Result<std::string> {
    auto reply = exchange(query, deadline);
    if (!reply) return pass(reply);
    if (reply->kind == Reply::Kind::error) return refusal(query, *reply);
    if (reply->text.empty()) return garbled(query, "*");
    return std::move(reply->text);
  });
}

Result<void> Link::order_once(std::string_view command, Time deadline) {
  auto reply = exchange(command, deadline);
  if (!reply) return pass(reply);
  if (reply->kind == Reply::Kind::error) return refusal(command, *reply);
  if (!reply->text.empty()) return garbled(command, reply->text);
  return {};
}

Result<void> Link::order(std::string_view command) {
  return with_retries(retry_, call_ends_, path(),
                      [&](Time deadline) { return order_once(command, deadline); });
}

Result<void> Link::stop(std::string_view command, std::string_view instead) {
  return with_retries(retry_, retry_.stop_ends(call_ends_), path(), [&](Time deadline) -> Result<void> {
    if (auto ok = write(command); !ok) return ok;
    // Answers to earlier commands may come first; a mere "*" among them cannot be told from this one's.
    const bool certain = in_step_;
    in_step_ = false;
    do {
      auto reply = next(command, deadline);
      if (!reply) return pass(reply);
      if (!*reply) break;
      if ((*reply)->kind == Reply::Kind::error && command != instead) {
        return order_once(instead, deadline);
      }
      if ((*reply)->kind == Reply::Kind::error) return refusal(command, **reply);
      if (!(*reply)->text.empty()) continue;
      in_step_ = certain;
      return {};
    } while (std::chrono::steady_clock::now() < deadline);
    return silence(command);
  });
}

Result<void> Link::send(std::string_view command) {
  return with_retries(retry_, call_ends_, path(), [&](Time deadline) -> Result<void> {
    if (auto ok = look_about(); !ok) return ok;
    if (auto ok = fall_into_step(deadline); !ok) return ok;
    return write(command);
  });
}

Result<std::optional<Reply>> Link::reply_to_sent() {
  auto reply = next({}, Time{});
  if (!reply && reply.error().code == ErrorCode::damaged) return std::optional<Reply>();
  return reply;
}

Result<void> Link::shout(std::string_view command) {
  in_step_ = false;
  return write(command);
}

void Link::set_marker(std::string query, std::string reply) {
  marker_query_ = std::move(query);
  marker_ = std::move(reply);
  in_step_ = false;
}

bool Link::take_limit(char axis) {
  return std::exchange(axis == 'P' ? pan_hit_ : tilt_hit_, false);
}

}  // namespace rig::drivers::ptu
