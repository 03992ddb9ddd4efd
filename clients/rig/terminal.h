// The terminal behind standard output.
#pragma once

#include <string>
#include <vector>

#include "clients/rig/terminal_text.h"

namespace rig::client {

/// Whether standard output is a terminal that can be used as a whole.
[[nodiscard]] bool is_terminal();

/// What it can show, and how large it is now.
[[nodiscard]] TerminalStyle terminal_style();

/// The terminal's other screen, without its cursor; given back as it was at the end.
class WholeTerminal {
 public:
  WholeTerminal();
  ~WholeTerminal();
  WholeTerminal(const WholeTerminal&) = delete;
  WholeTerminal& operator=(const WholeTerminal&) = delete;

  /// From the top, over what was there; no more lines than the terminal has rows.
  void draw(const std::vector<std::string>& lines);
};

}  // namespace rig::client
