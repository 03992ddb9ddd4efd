#include "clients/rig/watch_screen.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <unistd.h>
#include <vector>

#include "clients/rig/terminal.h"

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
      // A line that goes on in the next row would stay there.
      const auto width = static_cast<std::size_t>(std::max(terminal_style().columns - 1, 1));
      std::printf("\r\033[K%s", cut(progress, width).c_str());
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

class FullScreen : public WatchScreen {
 public:
  ~FullScreen() override {
    screen_.reset();
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
    screen_->draw(draw_watch(with_messages, terminal_style()));
  }
  [[nodiscard]] bool is_full() const override { return true; }

 private:
  std::unique_ptr<WholeTerminal> screen_ = std::make_unique<WholeTerminal>();
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

}  // namespace rig::client
