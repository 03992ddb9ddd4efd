#include "drivers/gpiod_lines/input_filter.h"

#include <algorithm>

namespace rig::drivers::gpiod_lines {

bool InputFilter::lasted(std::int64_t until_ns) const {
  // Times that run backwards are of different clocks and say nothing.
  return !since_ns_ || until_ns < *since_ns_ || until_ns - *since_ns_ >= debounce_ns_;
}

bool InputFilter::fold(const Edge& edge) {
  if (edge.active) {
    // Twice in a row: it was inactive for less time than the kernel takes to look.
    if (!active_) since_ns_ = edge.at_ns;
    if (active_ && since_ns_) since_ns_ = std::min(*since_ns_, edge.at_ns);
    active_ = true;
    return false;
  }
  if (active_) {
    active_ = false;
    return lasted(edge.at_ns);
  }
  // To inactive from inactive: when the kernel looked at the line behind its change, the pulse was over.
  const bool late = owed_ns_ && edge.at_ns <= *owed_ns_;
  owed_ns_.reset();
  return !late && debounce_ns_ == 0;
}

bool InputFilter::look(std::span<const Edge> edges, bool level, std::int64_t now_ns) {
  const bool some_dropped = edges.size() >= kEdgeQueue;
  bool seen = some_dropped;
  if (first_ && level) {
    active_ = true;
    since_ns_.reset();
  }
  first_ = false;
  for (const Edge& edge : edges) {
    if (fold(edge)) seen = true;
  }
  // What the level says and no edge told.
  if (level && !active_) {
    active_ = true;
    since_ns_ = now_ns;
  } else if (!level && active_) {
    seen = seen || lasted(now_ns);
    active_ = false;
    if (!some_dropped) owed_ns_ = now_ns;
  }
  return seen || (active_ && lasted(now_ns));
}

}  // namespace rig::drivers::gpiod_lines
