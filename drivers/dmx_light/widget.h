// A DMX USB Pro on its line.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"
#include "drivers/dmx_light/widget_protocol.h"

namespace rig::drivers::dmx_light {

class Widget {
 public:
  [[nodiscard]] static base::Result<std::unique_ptr<Widget>> open(const SerialSettings& line,
                                                                  const RetryPolicy& retry);

  /// All that follows belongs to a call that has to be over by then.
  void begin_call(Deadline ends) { call_ends_ = ends; }

  /// Also brings back a widget that was left in the middle of a message. What the widget puts out ends.
  [[nodiscard]] base::Result<std::string> serial();
  /// A name that the widget may not know: asked once. Output ends.
  [[nodiscard]] base::Result<std::string> name(Label which);
  /// Output goes on.
  [[nodiscard]] base::Result<Parameters> parameters();
  /// Puts a packet out from now on. A widget does not acknowledge that: the packet is followed by a request
  /// that it does answer, and that comes to it behind the packet.
  [[nodiscard]] base::Result<void> put_out(std::string_view channels);
  /// The same in one attempt: for the end, when nobody waits long.
  [[nodiscard]] base::Result<void> put_out_once(std::string_view channels);

 private:
  Widget(std::unique_ptr<SerialLine> line, const RetryPolicy& retry)
      : line_(std::move(line)), retry_(retry) {}
  /// One attempt: sends, and waits for a message with that label until then.
  [[nodiscard]] base::Result<Message> ask(std::string_view request, Label answer, Deadline answer_by);
  [[nodiscard]] base::Result<void> put_out_by(std::string_view channels, Deadline answer_by);

  const std::unique_ptr<SerialLine> line_;
  const RetryPolicy retry_;
  Deadline call_ends_ = Deadline::max();
};

}  // namespace rig::drivers::dmx_light
