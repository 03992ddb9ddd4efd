#include "drivers/sixk_axis/link.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "drivers/common/printable.h"

namespace rig::drivers::sixk {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr const char* kRevision = "TREV";

bool over(Link::Time deadline) {
  return std::chrono::steady_clock::now() >= deadline;
}

}  // namespace

tl::unexpected<base::Error> Link::silence(std::string_view command) {
  in_step_ = false;
  return fail(ErrorCode::timeout,
              fmt::format("the controller does not answer '{}' within {} ms", command, retry_.answer.count()),
              path(), "is it switched on, its address and the baud rate right?");
}

tl::unexpected<base::Error> Link::garbled(std::string_view command, std::string_view answer) {
  in_step_ = false;
  return fail(ErrorCode::damaged,
              fmt::format("'{}' is no answer of the controller to '{}'", printable(answer), command), path(),
              "look at the cable, its shield and the baud rate");
}

tl::unexpected<base::Error> Link::refusal(std::string_view command, std::string_view why) const {
  return fail(
      ErrorCode::device,
      fmt::format("the controller refuses '{}'{}{}", command, why.empty() ? "" : ": ", printable(why)),
      path());
}

bool Link::is_echo(std::string_view line) const {
  return std::equal(line.begin(), line.end(), sent_.begin(), sent_.end(), [](char a, char b) {
    return std::toupper(static_cast<unsigned char>(a)) == std::toupper(static_cast<unsigned char>(b));
  });
}

Result<void> Link::write(int axis, std::string_view command) {
  sent_ = (unit_ == 0 ? std::string() : fmt::format("{}_", unit_)) + "!" +
          (axis == 0 ? std::string() : std::to_string(axis)) + std::string(command);
  return stream_.write(sent_ + "\r\n", retry_.answer);
}

Result<void> Link::clear_line() {
  sent_ = "?";
  in_step_ = false;
  return stream_.write("?\r\n", retry_.answer);
}

Result<void> Link::shout(std::string_view command) {
  in_step_ = false;
  return write(0, command);
}

void Link::set_marker(std::string revision) {
  marker_ = std::move(revision);
  in_step_ = false;
}

// Takes what has come since; anything but an echo is something that nobody waits for any more.
Result<void> Link::look_about() {
  constexpr int kMost = 200;
  for (int i = 0; i < kMost; ++i) {
    auto reply = stream_.next(Time{});
    if (!reply) return pass(reply);
    if (!*reply) return {};
    if ((*reply)->kind != Reply::Kind::line || !is_echo((*reply)->text)) in_step_ = false;
  }
  return fail(ErrorCode::damaged, "the line never falls silent", path(), "is it a 6000 controller's?");
}

Result<void> Link::fall_into_step(Time deadline) {
  if (in_step_ || marker_.empty()) return {};
  if (auto ok = write(0, kRevision); !ok) return ok;
  bool marked = false;
  do {
    auto reply = stream_.next(deadline);
    if (!reply) return pass(reply);
    if (!*reply) break;
    if ((*reply)->kind == Reply::Kind::answer) {
      const auto value = value_in((*reply)->text, 0, kRevision, false);
      marked = value ? *value == marker_ : !names_ && (*reply)->text == marker_;
    }
    if (marked && (!names_ || (*reply)->kind == Reply::Kind::fine)) {
      in_step_ = true;
      return {};
    }
  } while (!over(deadline));
  return silence(kRevision);
}

Result<void> Link::begin(Time deadline) {
  if (auto ok = look_about(); !ok) return ok;
  return fall_into_step(deadline);
}

// The answer, and behind it the prompt.
Result<std::string> Link::await_value(int axis, std::string_view name, Time deadline) {
  std::optional<std::string> value;
  std::string message;
  do {
    auto reply = stream_.next(deadline);
    if (!reply) return pass(reply);
    if (!*reply) break;
    switch ((*reply)->kind) {
      case Reply::Kind::answer: {
        auto found = value_in((*reply)->text, axis, name, !names_);
        // A revision may be words and no number.
        if (!found && !names_ && name == kRevision) found = (*reply)->text;
        if (!found) message = (*reply)->text;
        if (found) value = std::move(found);
        break;
      }
      case Reply::Kind::fine:
        break;
      case Reply::Kind::bad:
        // Before there is a marker it may belong to what was shouted.
        if (!value && !marker_.empty()) return refusal(name, message);
        break;
      case Reply::Kind::defining:
        return fail(ErrorCode::device, "the controller is in the middle of a program's definition", path(),
                    "end it with END from a terminal");
      case Reply::Kind::line:
        if (!is_echo((*reply)->text) && !marker_.empty()) return garbled(name, (*reply)->text);
        break;
    }
    if (value && (!names_ || (*reply)->kind == Reply::Kind::fine)) return std::move(*value);
  } while (!over(deadline));
  return silence(name);
}

Result<void> Link::await_taken(std::string_view command, Time deadline) {
  std::string message;
  do {
    auto reply = stream_.next(deadline);
    if (!reply) return pass(reply);
    if (!*reply) break;
    switch ((*reply)->kind) {
      case Reply::Kind::answer:
        message = (*reply)->text;
        break;
      case Reply::Kind::fine:
        return {};
      case Reply::Kind::bad:
        return refusal(command, message);
      case Reply::Kind::defining:
        return fail(ErrorCode::device, "the controller is in the middle of a program's definition", path(),
                    "end it with END from a terminal");
      case Reply::Kind::line:
        if (!is_echo((*reply)->text)) return garbled(command, (*reply)->text);
        break;
    }
  } while (!over(deadline));
  return silence(command);
}

Result<std::string> Link::ask(int axis, std::string_view name) {
  return with_retries(retry_, call_ends_, path(), [&](Time deadline) -> Result<std::string> {
    if (auto ok = begin(deadline); !ok) return pass(ok);
    if (auto ok = write(axis, name); !ok) return pass(ok);
    return await_value(axis, name, deadline);
  });
}

Result<double> Link::number(int axis, std::string_view name) {
  return with_retries(retry_, call_ends_, path(), [&](Time deadline) -> Result<double> {
    if (auto ok = begin(deadline); !ok) return pass(ok);
    if (auto ok = write(axis, name); !ok) return pass(ok);
    const auto text = await_value(axis, name, deadline);
    if (!text) return pass(text);
    const auto value = number_in(*text);
    if (!value) return garbled(name, *text);
    return *value;
  });
}

Result<Status> Link::status(int axis) {
  return with_retries(retry_, call_ends_, path(), [&](Time deadline) -> Result<Status> {
    if (auto ok = begin(deadline); !ok) return pass(ok);
    if (auto ok = write(axis, "TAS"); !ok) return pass(ok);
    const auto text = await_value(axis, "TAS", deadline);
    if (!text) return pass(text);
    const auto status = status_in(*text);
    if (!status) return garbled("TAS", *text);
    return *status;
  });
}

Result<void> Link::order_once(int axis, std::string_view command, Time deadline) {
  if (auto ok = begin(deadline); !ok) return ok;
  if (auto ok = write(axis, command); !ok) return ok;
  if (names_) return await_taken(command, deadline);
  in_step_ = false;
  return fall_into_step(deadline);
}

Result<void> Link::order(int axis, std::string_view command) {
  return with_retries(retry_, call_ends_, path(),
                      [&](Time deadline) { return order_once(axis, command, deadline); });
}

Result<void> Link::stop(std::string_view command, std::string_view instead) {
  return with_retries(retry_, retry_.stop_ends(call_ends_), path(), [&](Time deadline) -> Result<void> {
    if (auto ok = write(0, command); !ok) return ok;
    // A prompt among what is still to come cannot be told from this command's.
    const bool certain = std::exchange(in_step_, false) && names_;
    if (!names_) return fall_into_step(deadline);
    auto taken = await_taken(command, deadline);
    if (taken) in_step_ = certain;
    if (!taken && taken.error().code == ErrorCode::device && command != instead) {
      return order_once(0, instead, deadline);
    }
    return taken;
  });
}

}  // namespace rig::drivers::sixk
