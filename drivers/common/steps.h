// Work that takes longer than one call may: done in pieces, some at each call.
#pragma once

#include <chrono>
#include <deque>
#include <functional>

#include "core/base/result.h"

namespace rig::drivers {

class Steps {
 public:
  /// Starts, polls or reads. `waiting`: asked again later; meanwhile nothing that comes after it is done.
  enum class Is { done, waiting };
  using Step = std::function<base::Result<Is>()>;

  void add(Step step) { steps_.push_back(std::move(step)); }
  void clear() { steps_.clear(); }
  [[nodiscard]] bool empty() const { return steps_.empty(); }

  /// Does steps until none is left (true), or one waits or `budget` is used up (false). An error ends all of
  /// them. A step may add further ones behind the last, and nothing else.
  [[nodiscard]] base::Result<bool> advance(std::chrono::milliseconds budget) {
    const auto end = std::chrono::steady_clock::now() + budget;
    while (!steps_.empty()) {
      const auto is = steps_.front()();
      if (!is) {
        steps_.clear();
        return base::pass(is);
      }
      if (*is == Is::waiting) return false;
      steps_.pop_front();
      if (!steps_.empty() && std::chrono::steady_clock::now() >= end) return false;
    }
    return true;
  }

 private:
  std::deque<Step> steps_;
};

}  // namespace rig::drivers
