// Where `rig watch` shows what it knows: a screen of its own on a terminal, or lines.
#pragma once

#include <memory>
#include <string>

#include "clients/rig/watch_view.h"

namespace rig::client {

class WatchScreen {
 public:
  WatchScreen() = default;
  WatchScreen(const WatchScreen&) = delete;
  WatchScreen& operator=(const WatchScreen&) = delete;
  virtual ~WatchScreen() = default;

  /// Something happened that a person should be able to read later.
  virtual void message(const std::string& text) = 0;
  /// What is the case now; `progress` says the same of the job in one line. Shown as often as is of use.
  virtual void show(const WatchView& view, const std::string& progress) = 0;
  /// Whether pictures and positions are of use.
  [[nodiscard]] virtual bool is_full() const = 0;
};

/// A line a message, and the progress in one that is overwritten on a terminal; elsewhere at most every ten
/// seconds.
[[nodiscard]] std::unique_ptr<WatchScreen> make_line_screen();

/// The whole terminal, given back as it was at the end; the messages then stay below.
[[nodiscard]] std::unique_ptr<WatchScreen> make_full_screen();

}  // namespace rig::client
