// What `rig watch` shows on a terminal: one screen, drawn from what is known. No I/O.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "clients/rig/terminal_text.h"
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

/// The screen from top to bottom: at most `rows` lines of at most `columns` letters each, colours not
/// counted. What does not fit is left out, the least important first: picture, histogram, messages.
[[nodiscard]] std::vector<std::string> draw_watch(const WatchView& view, const TerminalStyle& style);

/// Shares of the picture's pixels by luminance, `bins` of equal width over the range of its 8 bits.
[[nodiscard]] std::vector<double> preview_histogram(const protocol::Frame& preview, std::size_t bins);

}  // namespace rig::client
