#include "bench/night/bare_loop.h"

#include <span>
#include <string>

#include "core/base/files.h"
#include "core/base/hash.h"
#include "sim/hash_painter.h"

namespace rig::bench {

namespace fs = std::filesystem;

BareLoop::BareLoop(fs::path folder) : folder_(std::move(folder)) {
  camera_.width = 160;
  camera_.height = 120;
  camera_.black_dn = 64;
  camera_.saturation_dn = 4095;
  camera_.white_fills_s = 0.06;
  pixels_.resize(static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height));
}

base::Result<void> BareLoop::take(std::size_t poses) {
  constexpr std::size_t kFrames = 3;
  for (const std::size_t end = pose_ + poses; pose_ < end; ++pose_) {
    const fs::path part = folder_ / (std::to_string(pose_) + ".part");
    fs::create_directories(part);
    for (std::size_t i = 0; i < kFrames; ++i) {
      sim::paint_hashed(camera_, 0.06, 1, pose_ * kFrames + i, pixels_);
      const auto bytes = std::as_bytes(std::span(pixels_));
      if (base::sha256_hex(bytes).empty()) return base::fail(base::ErrorCode::damaged, "nothing was hashed");
      if (auto ok = base::write_and_flush(part / std::to_string(i), bytes); !ok) return ok;
    }
    if (auto ok = base::flush_folder(part); !ok) return ok;
    if (auto ok = base::rename_durably(part, folder_ / std::to_string(pose_)); !ok) return ok;
  }
  return {};
}

}  // namespace rig::bench
