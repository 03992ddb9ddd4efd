// How far long work is, and how long it will still take, for a person at a terminal or in a log.
#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>

namespace rig::base {

/// Prints "assemble: 12/64 poses, 19 %, 0:41 left" to standard error: on a terminal one line that is
/// overwritten, elsewhere a line every ten seconds. Safe to call from many threads.
class Progress {
 public:
  /// `unit` is the plural of what is counted: "poses", "texels".
  Progress(std::string stage, std::size_t total, std::string unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void add(std::size_t n = 1);

 private:
  using Steady = std::chrono::steady_clock;
  void print(bool last);

  std::mutex mutex_;
  std::string stage_;
  std::string unit_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool terminal_;
  Steady::time_point start_ = Steady::now();
  Steady::time_point printed_;
};

/// "0:41", "1:02:07".
[[nodiscard]] std::string format_duration(double seconds);

}  // namespace rig::base
