// What a 6000 controller says, cut into replies and read. Pure: bytes in, values out.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace rig::drivers::sixk {

struct Reply {
  enum class Kind {
    answer,    ///< "*1TPM+1000", or "*+1000" at error level 1; the message of an error, too
    fine,      ///< the prompt ">": the command was taken
    bad,       ///< the prompt "?": it was not
    defining,  ///< the prompt "-": it goes into a program that is being defined
    line,      ///< a line of anything else: an echo, noise
  };
  Kind kind = Kind::line;
  std::string text;  ///< of an answer what stands behind the star; of a line all of it

  [[nodiscard]] bool operator==(const Reply&) const = default;
};

/// Lines end with CR, LF or both. A prompt is complete without an end. A line without an end is handed out as
/// soon as it is longer than any answer. How the bytes are cut into pieces makes no difference.
class ReplyReader {
 public:
  void feed(std::string_view bytes) { rest_ += bytes; }
  [[nodiscard]] std::optional<Reply> next();

 private:
  std::string rest_;
};

/// The value in an answer to the query `name` (capitals) of an axis, 0 where it is of none: "+1000" in
/// "1TPM+1000", also behind an address ("3_1TPM+1000"). Of an answer without a name, where those are
/// `allowed`, all of it. Nothing: an answer to another query, or no answer but a message.
[[nodiscard]] std::optional<std::string> value_in(std::string_view answer, int axis, std::string_view name,
                                                  bool nameless_allowed);

/// "+1000", "1.2500": the whole text, or nothing.
[[nodiscard]] std::optional<double> number_in(std::string_view text);

/// The axis status, TAS: 32 bits, by fours or not.
struct Status {
  bool moving = false;
  bool homed = false;     ///< its last search for home was successful
  bool absolute = false;  ///< positioning mode MA1
  bool stalled = false;
  bool shut_down = false;  ///< the drive has no power
  bool drive_fault = false;
  bool positive_limit = false, negative_limit = false;  ///< hardware's or software's, in the motor's sense
  bool strayed = false;                                 ///< the position error is too large
  bool missed_zone = false;                             ///< not in the target zone in time
};
[[nodiscard]] std::optional<Status> status_in(std::string_view text);

/// What is wrong, in words; empty: nothing.
[[nodiscard]] std::string fault_of(const Status& status);

}  // namespace rig::drivers::sixk
