// Commands and replies of a pan-tilt unit over its line.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/common/reply_stream.h"
#include "drivers/common/retry.h"
#include "drivers/ptu_axis/reply.h"

namespace rig::drivers::ptu {

/// The unit answers every command with one reply, in their order, and gives replies no number: after one that
/// did not come it is not known whose the next one is. Then the link falls back into step before it asks
/// anything else: it sends a query whose reply is like no other, the resolution, and drops what comes before.
///
/// Errors: `lost` (the line is gone, or the unit has been switched off and on), `device` (the unit refuses,
/// or its replies are garbled again and again).
class Link {
 public:
  using Time = Deadline;

  Link(std::unique_ptr<SerialLine> line, RetryPolicy retry) : stream_(std::move(line)), retry_(retry) {}

  /// All that follows belongs to a call that has to be over by then.
  void begin_call(Deadline ends) { call_ends_ = ends; }

  /// The number that a query is answered with, asked for again where the reply is missing or garbled.
  [[nodiscard]] base::Result<double> number(std::string_view query);
  /// The text of a reply.
  [[nodiscard]] base::Result<std::string> text(std::string_view query);
  /// A command that may be sent twice; done when the unit says so.
  [[nodiscard]] base::Result<void> order(std::string_view command);
  /// As order(), but written before anything else is looked at, and also when the call's time is over;
  /// `instead` where the unit does not know it.
  [[nodiscard]] base::Result<void> stop(std::string_view command, std::string_view instead);

  /// Sends a command whose reply takes longer than a call may; it comes with reply_to_sent().
  [[nodiscard]] base::Result<void> send(std::string_view command);
  /// Nothing while it has not come; does not wait.
  [[nodiscard]] base::Result<std::optional<Reply>> reply_to_sent();
  /// Writes and waits for nothing. Whose the replies that follow are is open.
  [[nodiscard]] base::Result<void> shout(std::string_view command);

  /// From now on the link falls back into step with this query.
  void set_marker(std::string query, std::string reply);
  /// The unit has been told to be terse and not to echo: one that does either has forgotten it.
  void expect_terse() { terse_ = true; }
  /// That `axis` ('P' or 'T') hit an end stop since the last call.
  [[nodiscard]] bool take_limit(char axis);

  [[nodiscard]] const std::string& path() const { return stream_.path(); }

 private:
  [[nodiscard]] base::Result<void> write(std::string_view command);
  [[nodiscard]] base::Result<Reply> exchange(std::string_view command, Time deadline);
  [[nodiscard]] base::Result<std::optional<Reply>> next(std::string_view command, Time deadline);
  [[nodiscard]] base::Result<void> look_about();
  [[nodiscard]] base::Result<void> fall_into_step(Time deadline);
  [[nodiscard]] base::Result<void> order_once(std::string_view command, Time deadline);
  [[nodiscard]] tl::unexpected<base::Error> silence(std::string_view command);
  [[nodiscard]] tl::unexpected<base::Error> garbled(std::string_view command, std::string_view reply);
  [[nodiscard]] tl::unexpected<base::Error> restarted() const;
  [[nodiscard]] tl::unexpected<base::Error> refusal(std::string_view command, const Reply& reply) const;

  ReplyStream<ReplyReader> stream_;
  const RetryPolicy retry_;
  Deadline call_ends_ = Deadline::max();
  std::string marker_query_, marker_;
  bool in_step_ = false;
  bool terse_ = false;
  bool pan_hit_ = false, tilt_hit_ = false;
};

}  // namespace rig::drivers::ptu
