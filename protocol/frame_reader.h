// A client's side of frames.sock: frames of rigd on the same machine, without a copy.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>

#include "core/base/result.h"
#include "protocol/frame_buffer.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

/// A frame in rigd's memory. Valid as long as its FrameReader lives.
struct SeenFrame {
  LocalFrame facts;
  std::span<const std::uint16_t> pixels;  ///< width * height, row by row
  const FrameHeader* header = nullptr;

  /// Whether all that was read of `pixels` before this call belongs to this frame. rigd waits for no reader:
  /// one that looks too long loses the frame to the next that uses its memory. Ask after reading, before use.
  [[nodiscard]] bool intact() const;
};

/// One connection. Used from one thread.
class FrameReader {
 public:
  /// `socket` is frames.sock in rigd's runtime folder.
  [[nodiscard]] static base::Result<FrameReader> connect(const std::filesystem::path& socket);
  FrameReader(FrameReader&& other) noexcept;
  FrameReader& operator=(FrameReader&&) = delete;
  ~FrameReader();

  /// The next frame, waiting up to `timeout`. Where rigd ended the connection: ErrorCode::io.
  [[nodiscard]] base::Result<std::optional<SeenFrame>> next(std::chrono::milliseconds timeout);

 private:
  struct Mapping {
    void* memory;
    std::size_t bytes;
  };
  explicit FrameReader(int fd) : fd_(fd) {}
  [[nodiscard]] base::Result<Mapping> mapping_of(const LocalFrame& facts, int descriptor);
  int fd_;
  std::map<std::uint32_t, Mapping> mappings_;  // by slot: rigd's memory stays the same as long as it runs
};

}  // namespace rig::protocol
