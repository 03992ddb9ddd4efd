#include "clients/rig/watch_screen.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/ioctl.h>
#include <unistd.h>
#include <vector>

namespace rig::client {

namespace {

using Steady = std::chrono::steady_clock;

constexpr std::size_t kMostMessages = 200;
constexpr std::chrono::milliseconds kRedraw{100};

class LineScreen : public WatchScreen {
 public:
  ~LineScreen() override { clear(); }

  void message(const std::string& text) override {
    clear();
    std::printf("%s\n", text.c_str());
    std::fflush(stdout);
  }
  void show(const WatchView& /*view*/, const std::string& progress) override {
    const auto now = Steady::now();
    if (progress.empty()) return;
    if (terminal_) {
      std::printf("\r\033[K%s", progress.c_str());
      std::fflush(stdout);
      open_ = true;
    } else if (now - printed_ > std::chrono::seconds(10)) {
      printed_ = now;
      message(progress);
    }
  }
  [[nodiscard]] bool is_full() const override { return false; }

 private:
  void clear() {
    if (open_) std::printf("\r\033[K");
    open_ = false;
  }

  const bool terminal_ = ::isatty(STDOUT_FILENO) == 1;
  bool open_ = false;
  Steady::time_point printed_ = Steady::now() - std::chrono::seconds(60);
};

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

class FullScreen : public WatchScreen {
 public:
  FullScreen() {
    // The other screen of the terminal, without its cursor.
    std::printf("\033[?1049h\033[?25l");
  }
  ~FullScreen() override {
    std::printf("\033[?25h\033[?1049l");
    for (const std::string& text : messages_) std::printf("%s\n", text.c_str());
    std::fflush(stdout);
  }

  void message(const std::string& text) override {
    messages_.push_back(text);
    if (messages_.size() > kMostMessages) messages_.pop_front();
    drawn_ = {};
  }
  void show(const WatchView& view, const std::string& /*progress*/) override {
    const auto now = Steady::now();
    if (now - drawn_ < kRedraw) return;
    drawn_ = now;
    WatchView with_messages = view;
    with_messages.messages = messages_;
    std::string out = "\033[H";
    for (const std::string& line : draw_watch(with_messages, terminal_style())) out += line + "\033[K\n";
    // No line end behind the last line: a full screen would scroll.
    out.pop_back();
    out += "\033[J";
    std::fwrite(out.data(), 1, out.size(), stdout);
    std::fflush(stdout);
  }
  [[nodiscard]] bool is_full() const override { return true; }

 private:
  std::deque<std::string> messages_;
  Steady::time_point drawn_;
};

}  // namespace

std::unique_ptr<WatchScreen> make_line_screen() {
  return std::make_unique<LineScreen>();
}
std::unique_ptr<WatchScreen> make_full_screen() {
  return std::make_unique<FullScreen>();
}

bool is_terminal() {
  const char* kind = std::getenv("TERM");
  return ::isatty(STDOUT_FILENO) == 1 && kind != nullptr && std::strcmp(kind, "dumb") != 0;
}

}  // namespace rig::client
