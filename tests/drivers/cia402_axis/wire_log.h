// The frames that passed on a simulated bus, with their times.
#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>
#include <vector>

#include "sim/wire/can_hub.h"
#include "tests/drivers/cia402_axis/frames.h"

namespace rig::drivers::cia402 {

class WireLog {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Seen {
    can_frame frame;
    Time at;
  };

  explicit WireLog(sim::wire::CanHub& hub) : hub_(hub) {
    hub.listen([this](const can_frame& frame) {
      const std::lock_guard lock(mutex_);
      seen_.push_back({frame, std::chrono::steady_clock::now()});
    });
  }
  ~WireLog() { hub_.listen({}); }
  WireLog(const WireLog&) = delete;
  WireLog& operator=(const WireLog&) = delete;

  void clear() {
    const std::lock_guard lock(mutex_);
    seen_.clear();
  }
  /// Those under one identifier, in order.
  [[nodiscard]] std::vector<Seen> under(canid_t id) {
    const std::lock_guard lock(mutex_);
    std::vector<Seen> found;
    std::copy_if(seen_.begin(), seen_.end(), std::back_inserter(found),
                 [&](const Seen& s) { return s.frame.can_id == id; });
    return found;
  }
  [[nodiscard]] std::optional<Time> first(const can_frame& frame) {
    for (const Seen& s : under(frame.can_id)) {
      if (s.frame == frame) return s.at;
    }
    return std::nullopt;
  }
  /// The controlwords that were written to a node over its SDO server, in order, none twice in a row.
  [[nodiscard]] std::vector<int> controlwords(int node = 1) {
    std::vector<int> words;
    for (const Seen& s : under(0x600 + static_cast<canid_t>(node))) {
      if (s.frame.data[0] != 0x2B || s.frame.data[1] != 0x40 || s.frame.data[2] != 0x60) continue;
      const int word = s.frame.data[4] | s.frame.data[5] << 8;
      if (words.empty() || words.back() != word) words.push_back(word);
    }
    return words;
  }

 private:
  sim::wire::CanHub& hub_;
  std::mutex mutex_;
  std::vector<Seen> seen_;
};

}  // namespace rig::drivers::cia402
