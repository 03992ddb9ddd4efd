// Raw frames of a rigd on this machine, from its own memory instead of through the socket.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "protocol/frame_reader.h"

namespace rig::client {

class LocalFrames {
 public:
  /// Those of the rigd that answers at the endpoint. Nothing where it is on another machine, or keeps
  /// frames.sock from this client: then Snap's `full` brings the samples.
  [[nodiscard]] static std::optional<LocalFrames> beside(const std::string& endpoint);

  /// Adds the raw samples to a frame that rigd has answered with; false where they are not to be had any
  /// more.
  [[nodiscard]] bool add_raw(protocol::Frame& frame);
  /// rigd ended the connection: no further frame comes.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  explicit LocalFrames(protocol::FrameReader reader) : reader_(std::move(reader)) {}
  protocol::FrameReader reader_;
  bool ended_ = false;
};

}  // namespace rig::client
