// The least that could keep a night's frames: made, hashed, written and flushed, a folder a pose renamed when
// it is whole; no decisions, no journal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/base/result.h"
#include "sim/world.h"

namespace rig::bench {

class BareLoop {
 public:
  explicit BareLoop(std::filesystem::path folder);
  /// So many further poses of three frames of 160 x 120.
  [[nodiscard]] base::Result<void> take(std::size_t poses);

 private:
  std::filesystem::path folder_;
  sim::CameraWorld camera_;
  std::vector<std::uint16_t> pixels_;
  std::size_t pose_ = 0;
};

}  // namespace rig::bench
