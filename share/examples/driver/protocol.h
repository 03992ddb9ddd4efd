// The words of the Turner, a motor controller that nobody makes: one line asks, one line answers.
//
//   request   <tag><text>*<sum>\n      "3M 1200 500 2000*FA\n"
//   answer    <tag><text>*<sum>\n      "3M ok*7A\n"
//
// The tag is a digit that the answer repeats; the sum is that of all bytes before the star, modulo 256, as
// two capital hexadecimal digits.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace rig::drivers::turner {

[[nodiscard]] std::string request(int tag, std::string_view text);

/// The text of an answer, which comes without its end of line. `damaged` where the sum is wrong or the tag is
/// another one's.
[[nodiscard]] base::Result<std::string> answer(int tag, std::string_view line);

/// What "Q" is answered with: "Q <counts> <flags>".
struct Report {
  std::int32_t counts = 0;
  bool moving = false, homed = false, energised = false;
  bool at_low_limit = false, at_high_limit = false;
  bool fault = false;
};

/// `damaged` where it is none.
[[nodiscard]] base::Result<Report> report(std::string_view text);

/// What an order is answered with: "<verb> ok" or "<verb> no <reason>", which becomes the error that rigd
/// knows what to do about. `damaged` where it is neither, or the answer to another verb.
[[nodiscard]] base::Result<void> verdict(char verb, std::string_view text);

}  // namespace rig::drivers::turner
