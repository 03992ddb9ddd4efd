#include "drivers/dmx_light/widget.h"

#include <algorithm>

namespace rig::drivers::dmx_light {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

Result<std::unique_ptr<Widget>> Widget::open(const SerialSettings& line, const RetryPolicy& retry) {
  auto opened = SerialLine::open(line);
  if (!opened) return pass(opened);
  return std::unique_ptr<Widget>(new Widget(std::move(*opened), retry));
}

Result<Message> Widget::ask(std::string_view request, Label answer, Deadline answer_by) {
  line_->discard_input();
  const auto left = [&] {
    return std::max(std::chrono::ceil<milliseconds>(answer_by - Steady::now()), milliseconds(0));
  };
  const milliseconds within = left();
  if (auto ok = line_->write(request, within); !ok) return pass(ok);
  std::string come;
  std::size_t noise = 0;
  while (true) {
    // Messages that nobody asked for (DMX that it received) are passed over.
    while (auto message = take_message(come, noise)) {
      if (message->label == static_cast<std::uint8_t>(answer)) return *message;
    }
    // Also on a line that never falls silent.
    if (Steady::now() >= answer_by) {
      if (noise == 0 && come.empty()) {
        return fail(ErrorCode::timeout, fmt::format("no answer of the widget within {} ms", within.count()),
                    line_->path(), "is this the right port?");
      }
      return fail(ErrorCode::damaged, fmt::format("{} bytes and no answer of a widget", noise + come.size()),
                  line_->path(), "is this a DMX USB Pro?");
    }
    auto first = line_->read_exactly(1, left());
    if (!first && first.error().code != ErrorCode::timeout) return pass(first);
    if (!first) continue;
    auto rest = line_->read_waiting();
    if (!rest) return pass(rest);
    come += *first + *rest;
  }
}

Result<std::string> Widget::serial() {
  int attempt = 0;
  return with_retries(retry_, call_ends_, line_->path(), [&](Deadline answer_by) -> Result<std::string> {
    // Whatever message it may be in the middle of, these bytes end it; between messages they are nothing.
    std::string request(attempt++ == 0 ? 0 : kLongestData + 1, '\0');
    request += encode(Label::serial, {});
    return ask(request, Label::serial, answer_by).and_then(&read_serial);
  });
}

Result<std::string> Widget::name(Label which) {
  const Deadline answer_by = std::min(call_ends_, Steady::now() + retry_.answer);
  return ask(encode(which, {}), which, answer_by).and_then(&read_name);
}

Result<Parameters> Widget::parameters() {
  return with_retries(retry_, call_ends_, line_->path(), [&](Deadline answer_by) {
    return ask(encode_parameters_request(), Label::parameters, answer_by).and_then(&read_parameters);
  });
}

Result<void> Widget::put_out_by(std::string_view channels, Deadline answer_by) {
  return ask(encode_output(channels) + encode_parameters_request(), Label::parameters, answer_by)
      .and_then(&read_parameters)
      .map([](const Parameters&) {});
}

Result<void> Widget::put_out_once(std::string_view channels) {
  return put_out_by(channels, Steady::now() + retry_.answer);
}

Result<void> Widget::put_out(std::string_view channels) {
  return with_retries(retry_, call_ends_, line_->path(),
                      [&](Deadline answer_by) { return put_out_by(channels, answer_by); });
}

}  // namespace rig::drivers::dmx_light
