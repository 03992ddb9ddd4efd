// Whether what came from the camera is the frame that was asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace rig::drivers::aravis {

/// What is known of a received buffer. Everything in it was told by the camera or the wire.
struct BufferFacts {
  std::string damage;  ///< the receiver's own verdict: empty where every packet came
  bool is_image = true;
  std::uint64_t frame_id = 0;
  std::uint32_t format = 0;
  int offset_x = 0, offset_y = 0, width = 0, height = 0;
  int line_padding = 0;                             ///< bytes after each line
  std::size_t bytes = 0;                            ///< received
  std::int64_t taken_ns = 0;                        ///< by the wall clock of this machine
  std::optional<double> exposure_s = std::nullopt;  ///< where the frame itself says it
  /// From its beginning, by the camera's own time, to its trigger; below 0: it began after that. Nothing
  /// where the camera's clock is not known.
  std::optional<double> before_trigger_s = std::nullopt;
};

struct Expected {
  std::uint32_t format = 0;
  int offset_x = 0, offset_y = 0, width = 0, height = 0;
  std::size_t image_bytes = 0;    ///< of the samples alone
  std::size_t payload_bytes = 0;  ///< with what the camera appends
  double exposure_s = 0;          ///< the setting that is in effect
  /// The number of the frame before; nothing where it is not known, or the camera does not count.
  std::optional<std::uint64_t> last_id = std::nullopt;
  /// For a camera that runs free: frames taken before this are of an older setting.
  std::optional<std::int64_t> not_before_ns = std::nullopt;
  double clock_error_s = 0;  ///< of before_trigger_s
};

enum class Verdict {
  good,
  old,     ///< taken before it was asked for
  spoilt,  ///< the exposure is over, and this frame is no good; another may be
  bad,     ///< the camera is not as it was set up
};

struct Judgement {
  Verdict verdict = Verdict::good;
  std::string why;  ///< of a spoilt or a bad one
};

[[nodiscard]] Judgement judge(const Expected& expected, const BufferFacts& facts);

/// The number that follows in a camera without gaps: GigE Vision counts to 65535 and goes on with 1.
[[nodiscard]] bool follows(std::uint64_t last, std::uint64_t id);

}  // namespace rig::drivers::aravis
