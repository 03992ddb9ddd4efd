// What the tests of camera drivers share: settings as text, the camera on them, what it said, and its frames
// waited for.
#pragma once

#include <algorithm>
#include <chrono>
#include <gtest/gtest.h>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "core/base/clock.h"
#include "core/base/config.h"
#include "core/base/log.h"
#include "drivers/api/device.h"
#include "drivers/common/camera_module.h"

namespace rig::test {

/// The settings that a text says, by the driver's reader; a mistake in it is thrown.
template <typename Read>
[[nodiscard]] auto settings_from(const std::string& text, Read read) {
  const auto table = base::ConfigTable::parse(text, "camera.toml");
  if (!table) throw std::runtime_error(table.error().text());
  auto settings = read(*table);
  if (auto fine = table->finish(); !fine) throw std::runtime_error(fine.error().text());
  return settings;
}

/// What is wrong with them; empty: nothing.
template <typename Read>
[[nodiscard]] std::string faults_from(const std::string& text, Read read) {
  const auto table = base::ConfigTable::parse(text, "camera.toml");
  if (!table) return table.error().text();
  (void)read(*table);
  const auto fine = table->finish();
  return fine ? "" : fine.error().text();
}

/// Looks at `ready` until it is true; false: not within `within`.
template <typename Ready>
[[nodiscard]] bool eventually(Ready&& ready, std::chrono::milliseconds within = std::chrono::seconds(20)) {
  const auto until = std::chrono::steady_clock::now() + within;
  while (!ready()) {
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// What the driver said. Any thread may say something.
class Said {
 public:
  [[nodiscard]] drivers::CameraLog log() {
    return [lines = lines_](base::LogLevel, const std::string& text) {
      const std::lock_guard lock(lines->mutex);
      lines->lines.push_back(text);
    };
  }
  /// The lines with this in them.
  [[nodiscard]] std::vector<std::string> with(const std::string& part) const {
    std::vector<std::string> found;
    const std::lock_guard lock(lines_->mutex);
    std::copy_if(lines_->lines.begin(), lines_->lines.end(), std::back_inserter(found),
                 [&](const std::string& line) { return line.find(part) != std::string::npos; });
    return found;
  }
  [[nodiscard]] bool has(const std::string& part) const { return !with(part).empty(); }

 private:
  struct Lines {
    std::mutex mutex;
    std::vector<std::string> lines;
  };
  std::shared_ptr<Lines> lines_ = std::make_shared<Lines>();
};

/// A camera, and room for its frames.
class CameraRig {
 public:
  /// `open` makes it: (clock, log). Where it fails that is thrown.
  template <typename Open>
  explicit CameraRig(Open&& open) {
    auto camera = open(*clock_, said_.log());
    if (!camera) throw std::runtime_error(camera.error().text());
    camera_ = std::move(*camera);
    capabilities_ = camera_->capabilities();
    pixels_.resize(static_cast<std::size_t>(capabilities_.width) *
                   static_cast<std::size_t>(capabilities_.height));
  }

  [[nodiscard]] drivers::Camera& camera() { return *camera_; }
  [[nodiscard]] base::Clock& clock() { return *clock_; }
  [[nodiscard]] std::vector<std::uint16_t>& pixels() { return pixels_; }
  [[nodiscard]] const drivers::CameraCapabilities& capabilities() const { return capabilities_; }
  [[nodiscard]] const Said& said() const { return said_; }

  using Frame = base::Result<std::optional<drivers::FrameInfo>>;
  /// Of an exposure that was begun: the frame, in pixels(); nothing within `within`; or the error.
  [[nodiscard]] Frame wait_for_frame(std::chrono::milliseconds within = std::chrono::milliseconds(5000)) {
    Frame frame;
    (void)eventually(
        [&] {
          frame = camera_->fetch(pixels_);
          return !frame || frame->has_value();
        },
        within);
    return frame;
  }
  /// Triggers and waits.
  [[nodiscard]] Frame take(double exposure_s, double gain = 1) {
    if (auto begun = camera_->trigger(exposure_s, gain); !begun) return base::pass(begun);
    return wait_for_frame();
  }
  void close() { camera_.reset(); }

 protected:
  [[nodiscard]] std::size_t width() const { return static_cast<std::size_t>(capabilities_.width); }

 private:
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  Said said_;
  std::unique_ptr<drivers::Camera> camera_;
  drivers::CameraCapabilities capabilities_;
  std::vector<std::uint16_t> pixels_;
};

/// Triggers; fails the test unless a whole frame of this exposure comes, which no pixel contradicts: what its
/// pixels say is `rig.painted()`.
template <typename Rig>
void expect_frame(Rig& rig, double exposure_s) {
  const auto frame = rig.take(exposure_s);
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  ASSERT_TRUE(frame->has_value()) << "no frame of " << exposure_s << " s";
  const auto painted = rig.painted();
  ASSERT_TRUE(painted.has_value()) << "the pixels contradict each other";
  EXPECT_NEAR(painted->exposure_us * 1e-6, exposure_s, 1e-6);
  EXPECT_NEAR((*frame)->exposure_s, exposure_s, 1e-9);
}

}  // namespace rig::test
