#include "clients/rig/local_frames.h"

#include <chrono>
#include <string_view>
#include <utility>

namespace rig::client {

namespace {

constexpr std::string_view kOnThisMachine = "ipc://";
// rigd tells of a frame before it answers with it.
constexpr std::chrono::milliseconds kPatience{200};

}  // namespace

std::optional<LocalFrames> LocalFrames::beside(const std::string& endpoint) {
  if (!endpoint.starts_with(kOnThisMachine)) return std::nullopt;
  const std::filesystem::path socket = endpoint.substr(kOnThisMachine.size());
  auto reader = protocol::FrameReader::connect(socket.parent_path() / "frames.sock");
  if (!reader) return std::nullopt;
  return LocalFrames(std::move(*reader));
}

bool LocalFrames::add_raw(protocol::Frame& frame) {
  // What came since the frame before, a job's for instance, is passed over.
  while (true) {
    const auto seen = reader_.next(kPatience);
    ended_ = !seen;
    if (!seen || !*seen) return false;
    const protocol::LocalFrame& facts = (*seen)->facts;
    if (facts.counter() != frame.counter() || facts.width() != frame.width() ||
        facts.height() != frame.height()) {
      continue;
    }
    const auto pixels = (*seen)->pixels;
    frame.set_raw(pixels.data(), pixels.size_bytes());
    if ((*seen)->intact()) return true;
    frame.clear_raw();
    return false;
  }
}

}  // namespace rig::client
