// Says, and not too often, that frames were lost or damaged on their way.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/v4l2_camera/configure.h"
#include "drivers/v4l2_camera/frame_sieve.h"

namespace rig::drivers::v4l2 {

class LossReport {
 public:
  LossReport(Log log, std::string called) : log_(std::move(log)), called_(std::move(called)) {}

  /// Of each frame. `expected`: all buffers were full, so that the camera had nowhere to put frames that
  /// nobody asked for.
  void note(const Judgement& judgement, bool expected);

 private:
  const Log log_;
  const std::string called_;
  std::uint64_t lost_ = 0, damaged_ = 0;  // since it was said
  std::optional<std::chrono::steady_clock::time_point> said_at_;
};

}  // namespace rig::drivers::v4l2
