// A chip of lines, as the kernel's GPIO interface (its first version) offers it, with the lines of one module
// requested. Two things can be behind it: the kernel, through libgpiod, and for tests a socket.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::drivers::gpiod_lines {

using base::Result;

enum class Bias { as_is, none, pull_up, pull_down };
enum class Drive { push_pull, open_drain, open_source };
/// What an output is set to when nobody asked for anything. keep: it stays as it is.
enum class Rest { inactive, active, keep };

struct LineRequest {
  std::string name;                    ///< by which rigd knows the line
  std::optional<unsigned int> offset;  ///< on the chip; else by label:
  std::string label;                   ///< the line's name on the chip
  bool active_low = false;
  bool output = false;
  Bias bias = Bias::pull_up;       ///< of an input
  bool edges = true;               ///< of an input: the chip tells of each change
  Drive drive = Drive::push_pull;  ///< of an output
  Rest at_start = Rest::inactive;  ///< of an output; keep is inactive where the line is no output yet
};

/// A change of an input.
struct Edge {
  bool active = false;     ///< to active
  std::int64_t at_ns = 0;  ///< CLOCK_MONOTONIC
};

/// Lines are named by their index in the requests that the chip was opened with. Whatever fails on an open
/// chip is `lost`: an adapter was unplugged, or nothing more can be known.
class LineChip {
 public:
  LineChip() = default;
  LineChip(const LineChip&) = delete;
  LineChip& operator=(const LineChip&) = delete;
  /// Gives the lines back; their levels stay what they are.
  virtual ~LineChip() = default;

  /// Whether the line is active now; of an output, what its pin is at.
  [[nodiscard]] virtual Result<bool> level(std::size_t line) = 0;
  [[nodiscard]] virtual Result<void> set(std::size_t line, bool active) = 0;
  /// The changes since the last call, oldest first; none from a line that was requested without edges. The
  /// kernel keeps kEdgeQueue of a line and drops those that come later.
  [[nodiscard]] virtual Result<std::vector<Edge>> edges(std::size_t line) = 0;
};

inline constexpr std::size_t kEdgeQueue = 16;
/// The names of the consumer by which the kernel lists who has a line.
inline constexpr const char* kConsumer = "rigd";
/// Chips with this in front are sockets.
inline constexpr const char* kSocketPrefix = "unix:";

/// `chip` is the label, the name or the path of a gpiochip, or "unix:" and the path of a socket. Outputs are
/// at their level of start when this returns.
[[nodiscard]] Result<std::unique_ptr<LineChip>> open_chip(const std::string& chip,
                                                          const std::vector<LineRequest>& requests);

}  // namespace rig::drivers::gpiod_lines
