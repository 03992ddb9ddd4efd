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

Result<Message> Widget::ask(std::string_view request, Label answer) {
  line_->discard_input();
  const auto deadline = Steady::now() + retry_.answer;
  const auto left = [&] {
    return std::max(std::chrono::ceil<milliseconds>(deadline - Steady::now()), milliseconds(0));
  };
  if (auto ok = line_->write(request, retry_.answer); !ok) return pass(ok);
  std::string come;
  std::size_t noise = 0;
  while (true) {
    // Messages that nobody asked for (DMX that it received) are passed over.
    while (auto message = take_message(come, noise)) {
      if (message->label == static_cast<std::uint8_t>(answer)) return *message;
    }
    auto first = line_->read_exactly(1, left());
    if (!first && first.error().code == ErrorCode::timeout) {
      if (noise == 0 && come.empty()) {
        return fail(ErrorCode::timeout,
                    fmt::format("no answer of the widget within {} ms", retry_.answer.count()), line_->path(),
                    "is this the right port?");
      }
      return fail(ErrorCode::damaged, fmt::format("{} bytes and no answer of a widget", noise + come.size()),
                  line_->path(), "is this a DMX USB Pro?");
    }
    if (!first) return pass(first);
    auto rest = line_->read_waiting();
    if (!rest) return pass(rest);
    come += *first + *rest;
  }
}

Result<std::string> Widget::serial() {
  int attempt = 0;
  return with_retries(retry_, [&]() -> Result<std::string> {
    // Whatever message it may be in the middle of, these bytes end it; between messages they are nothing.
    std::string request(attempt++ == 0 ? 0 : kLongestData + 1, '\0');
    request += encode(Label::serial, {});
    return ask(request, Label::serial).and_then(&read_serial);
  });
}

Result<std::string> Widget::name(Label which) {
  return ask(encode(which, {}), which).and_then(&read_name);
}

Result<Parameters> Widget::parameters() {
  return with_retries(
      retry_, [&] { return ask(encode_parameters_request(), Label::parameters).and_then(&read_parameters); });
}

Result<void> Widget::put_out_once(std::string_view channels) {
  return ask(encode_output(channels) + encode_parameters_request(), Label::parameters)
      .and_then(&read_parameters)
      .map([](const Parameters&) {});
}

Result<void> Widget::put_out(std::string_view channels) {
  return with_retries(retry_, [&] { return put_out_once(channels); });
}

}  // namespace rig::drivers::dmx_light
