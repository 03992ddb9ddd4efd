// What `rig live` shows: a screen, a line a frame, or a set of figures. No I/O.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "clients/rig/live_frame.h"
#include "clients/rig/terminal_text.h"

namespace rig::client {

struct LiveView {
  LiveFrame frame;                   ///< the newest
  protocol::Frame picture;           ///< of it; without pixels: none
  double best_focus = 0;             ///< of all frames so far
  std::deque<double> focus_history;  ///< the newest last
  std::vector<int> expected;         ///< ids of the carrier's fiducials; empty: not known
  bool automatic = false;            ///< the exposure follows the level
  std::string rig, light;            ///< lines about them
  std::string note;                  ///< what keeps the next frame from coming; empty: nothing
};

/// "0-3, 5, 7-19"; `ids` ascending.
[[nodiscard]] std::string id_ranges(const std::vector<int>& ids);

/// The screen from top to bottom, at most as large as the terminal; the picture where there is room for it.
[[nodiscard]] std::vector<std::string> draw_live(const LiveView& view, const TerminalStyle& style);

/// The newest frame in one line.
[[nodiscard]] std::string live_line(const LiveView& view);

/// A line each, name and value, for scripts.
[[nodiscard]] std::string live_figures(const LiveFrame& frame);

}  // namespace rig::client
