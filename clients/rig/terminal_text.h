// Letters that draw: bars, columns and pictures for a terminal. No I/O.
#pragma once

#include <string>
#include <vector>

#include "protocol/rig.pb.h"

namespace rig::client {

struct TerminalStyle {
  int columns = 80, rows = 24;
  bool utf8 = true;
  bool colour = true;  ///< 24 bits
};

/// Letters that a line takes on a terminal: code points, without colour sequences.
[[nodiscard]] std::size_t display_width(const std::string& line);

/// The line cut to so many letters. Only for lines without colours.
[[nodiscard]] std::string cut(const std::string& line, std::size_t width);

/// The text in lines of at most so many letters, broken between words where there are any; those after the
/// first begin with `indent`. Only for text without colours.
[[nodiscard]] std::vector<std::string> wrapped(const std::string& text, std::size_t width,
                                               const std::string& indent);

/// With spaces behind it up to so many letters.
[[nodiscard]] std::string padded(const std::string& line, std::size_t width);

/// A bar of `width` letters, filled to `share` (clamped to 0 .. 1).
[[nodiscard]] std::string bar(double share, std::size_t width, bool utf8);

/// A column a letter, each of a height from 0 to 1.
[[nodiscard]] std::string column_chart(const std::vector<double>& heights, bool utf8);

/// The preview as cells of two pixels, one above the other, at most so wide and high; empty where there is
/// none.
[[nodiscard]] std::vector<std::string> picture_lines(const protocol::Frame& preview, std::size_t width,
                                                     std::size_t most_rows);

}  // namespace rig::client
