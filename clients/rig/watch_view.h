// What `rig watch` shows on a terminal: one screen, drawn from what is known. No I/O.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "protocol/rig.pb.h"

namespace rig::client {

struct WatchView {
  protocol::Status status;
  protocol::JobInfo job;                      ///< 0 as its number: none
  protocol::PoseStarted pose;                 ///< of the job, being taken
  std::vector<protocol::FrameTaken> bracket;  ///< the newest, so far
  protocol::Frame preview;                    ///< the newest picture; without pixels: none yet
  double seconds_left = -1;                   ///< wall time; negative: not known yet
  std::deque<std::string> messages;           ///< what happened, the newest last
};

struct TerminalStyle {
  int columns = 80, rows = 24;
  bool utf8 = true;
  bool colour = true;  ///< 24 bits
};

/// The screen from top to bottom: at most `rows` lines of at most `columns` letters each, colours not
/// counted. What does not fit is left out, the least important first: picture, histogram, messages.
[[nodiscard]] std::vector<std::string> draw_watch(const WatchView& view, const TerminalStyle& style);

/// Letters that a line takes on a terminal: code points, without colour sequences.
[[nodiscard]] std::size_t display_width(const std::string& line);

/// A bar of `width` letters, filled to `share` (clamped to 0 .. 1).
[[nodiscard]] std::string bar(double share, std::size_t width, bool utf8);

/// Shares of the picture's pixels by luminance, `bins` of equal width over the range of its 8 bits.
[[nodiscard]] std::vector<double> preview_histogram(const protocol::Frame& preview, std::size_t bins);

}  // namespace rig::client
