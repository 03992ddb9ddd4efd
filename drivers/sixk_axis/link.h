// Commands and answers of a 6000 controller over its line.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/common/reply_stream.h"
#include "drivers/common/retry.h"
#include "drivers/sixk_axis/reply.h"

namespace rig::drivers::sixk {

/// All commands are immediate ("!"): they are carried out in their order, whatever moves.
///
/// At error level 4 a prompt says that a command was taken or not, and an answer says to which query. At
/// level 1 there are neither: the link asks for the controller's revision behind each command, and its answer
/// shows that the command was read. It does the same at both levels after an answer that did not come,
/// because whose the next one is is not known then.
///
/// Errors: `lost`, `device` (the controller refuses, or its answers are garbled again and again).
class Link {
 public:
  using Time = Deadline;

  Link(std::unique_ptr<SerialLine> line, RetryPolicy retry, int unit, int error_level)
      : stream_(std::move(line)), retry_(retry), unit_(unit), names_(error_level == 4) {}

  /// All that follows belongs to a call that has to be over by then.
  void begin_call(Deadline ends) { call_ends_ = ends; }

  /// The value that the query of an axis (0: of none) is answered with.
  [[nodiscard]] base::Result<std::string> ask(int axis, std::string_view name);
  [[nodiscard]] base::Result<double> number(int axis, std::string_view name);
  [[nodiscard]] base::Result<Status> status(int axis);
  /// A command that may be sent twice. Axis 0: without an axis.
  [[nodiscard]] base::Result<void> order(int axis, std::string_view command);
  /// As order(), but written before anything else is looked at, and also when the call's time is over;
  /// `instead` where the controller refuses it.
  [[nodiscard]] base::Result<void> stop(std::string_view command, std::string_view instead);
  /// Writes and waits for nothing.
  [[nodiscard]] base::Result<void> shout(std::string_view command);
  /// Writes what spoils the beginning of a line, should one stand in the controller's input.
  [[nodiscard]] base::Result<void> clear_line();

  /// From now on the link falls back into step with the revision.
  void set_marker(std::string revision);

  [[nodiscard]] const std::string& path() const { return stream_.path(); }

 private:
  [[nodiscard]] base::Result<void> write(int axis, std::string_view command);
  [[nodiscard]] base::Result<void> begin(Time deadline);
  [[nodiscard]] base::Result<void> look_about();
  [[nodiscard]] base::Result<void> fall_into_step(Time deadline);
  [[nodiscard]] base::Result<std::string> await_value(int axis, std::string_view name, Time deadline);
  [[nodiscard]] base::Result<void> await_taken(std::string_view command, Time deadline);
  [[nodiscard]] base::Result<void> order_once(int axis, std::string_view command, Time deadline);
  [[nodiscard]] bool is_echo(std::string_view line) const;
  [[nodiscard]] tl::unexpected<base::Error> silence(std::string_view command);
  [[nodiscard]] tl::unexpected<base::Error> garbled(std::string_view command, std::string_view answer);
  [[nodiscard]] tl::unexpected<base::Error> refusal(std::string_view command, std::string_view why) const;

  ReplyStream<ReplyReader> stream_;
  const RetryPolicy retry_;
  Deadline call_ends_ = Deadline::max();
  const int unit_;
  const bool names_;  ///< answers say whose they are, and prompts follow
  std::string marker_;
  std::string sent_;  ///< the last line
  bool in_step_ = false;
};

}  // namespace rig::drivers::sixk
