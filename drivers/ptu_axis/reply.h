// What a pan-tilt unit says, cut into replies. Pure: bytes in, replies out.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace rig::drivers::ptu {

struct Reply {
  enum class Kind {
    fine,    ///< "*", or "* 22": the answer to a command or a query
    error,   ///< "! Maximum allowable Pan position is 3090"
    limit,   ///< "!P" or "!T", which nobody asked for: an axis hit an end stop
    banner,  ///< what the unit says when it is switched on
    noise,   ///< a line of anything else
  };
  Kind kind = Kind::noise;
  std::string text;    ///< behind the mark; of a limit "P" or "T"; of banner and noise the line
  std::string before;  ///< of fine and error: what stood before the mark in its line, an echo as a rule

  [[nodiscard]] bool operator==(const Reply&) const = default;
};

/// Lines end with CR, LF or both, with spaces before it or not. "!P" may stand before a reply in its line,
/// and several of them ("!T!T!P!P*"). A line without an end is noise as soon as it is longer than any reply.
/// How the bytes are cut into pieces makes no difference.
class ReplyReader {
 public:
  void feed(std::string_view bytes) { rest_ += bytes; }
  [[nodiscard]] std::optional<Reply> next();

 private:
  [[nodiscard]] std::optional<Reply> take_limit();
  std::string rest_;
};

/// The first number in a reply: terse "22", wordy "Current Pan position is -2500", "92.5714 seconds arc per
/// position".
[[nodiscard]] std::optional<double> number_in(std::string_view text);

/// A reply to a query is nothing but the number, as after FT.
[[nodiscard]] bool is_terse(std::string_view text);
/// It is a sentence, as before FT: "Current Pan position is -2500".
[[nodiscard]] bool is_wordy(std::string_view text);

/// The temperature in "Input 30 VDC @ 86 degF", in degrees Celsius; nothing where it says none.
[[nodiscard]] std::optional<double> temperature_c_in(std::string_view text);

}  // namespace rig::drivers::ptu
