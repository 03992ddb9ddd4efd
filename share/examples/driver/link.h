// Questions and answers over the Turner's serial line, which may be unplugged and come back.
#pragma once

#include <string>
#include <string_view>

#include "drivers/common/connection.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"

namespace rig::drivers::turner {

class Link {
 public:
  Link(const SerialSettings& serial, const RetryPolicy& policy, base::Clock& clock);

  /// What `read` makes of the answer to `text`: a Result, `damaged` where it is no such answer. Asked again
  /// where none or a garbled one comes, so only for what may be done twice. `lost` where the line is gone or
  /// nobody answers, `device` where the answers stay garbled. Each call of this driver is one question, which
  /// has its time by itself; where one asks several, make RetryPolicy::call_ends() at its beginning, and hand
  /// it to with_retries().
  template <typename Read>
  [[nodiscard]] auto ask(std::string_view text, Read&& read) -> decltype(read(std::string())) {
    return line_.use([&](SerialLine& line) {
      return with_retries(policy_, [&]() -> decltype(read(std::string())) {
        const auto answer = attempt(line, text);
        if (!answer) return base::pass(answer);
        return read(*answer);
      });
    });
  }

 private:
  [[nodiscard]] base::Result<std::string> attempt(SerialLine& line, std::string_view text);

  const RetryPolicy policy_;
  Connection<SerialLine> line_;
  int tag_ = 0;
};

}  // namespace rig::drivers::turner
