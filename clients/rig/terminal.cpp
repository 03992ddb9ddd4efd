#include "clients/rig/terminal.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/ioctl.h>
#include <unistd.h>

namespace rig::client {

bool is_terminal() {
  const char* kind = std::getenv("TERM");
  return ::isatty(STDOUT_FILENO) == 1 && kind != nullptr && std::strcmp(kind, "dumb") != 0;
}

TerminalStyle terminal_style() {
  TerminalStyle style;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0) {
    style.columns = size.ws_col;
    style.rows = size.ws_row;
  }
  const auto says_utf8 = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr &&
           (std::strstr(value, "UTF-8") != nullptr || std::strstr(value, "utf8") != nullptr);
  };
  style.utf8 = says_utf8("LC_ALL") || says_utf8("LC_CTYPE") || says_utf8("LANG");
  style.colour = std::getenv("NO_COLOR") == nullptr;
  return style;
}

WholeTerminal::WholeTerminal() {
  std::printf("\033[?1049h\033[?25l");
}

WholeTerminal::~WholeTerminal() {
  std::printf("\033[?25h\033[?1049l");
  std::fflush(stdout);
}

void WholeTerminal::draw(const std::vector<std::string>& lines) {
  std::string out = "\033[H";
  for (const std::string& line : lines) out += line + "\033[K\n";
  // No line end behind the last line: a full screen would scroll.
  if (!lines.empty()) out.pop_back();
  out += "\033[J";
  std::fwrite(out.data(), 1, out.size(), stdout);
  std::fflush(stdout);
}

}  // namespace rig::client
