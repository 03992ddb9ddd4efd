#include "tests/drivers/v4l2_camera/support.h"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <unistd.h>

namespace rig::drivers::v4l2 {

Settings settings_of(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "camera.toml");
  if (!table) throw std::runtime_error(table.error().text());
  Settings settings = read_settings(*table);
  if (auto fine = table->finish(); !fine) throw std::runtime_error(fine.error().text());
  return settings;
}

std::string faults_of(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "camera.toml");
  if (!table) return table.error().text();
  (void)read_settings(*table);
  const auto fine = table->finish();
  return fine ? "" : fine.error().text();
}

std::filesystem::path socket_path() {
  static std::atomic<int> number{0};
  return std::filesystem::temp_directory_path() /
         fmt::format("rig-v4l2-{}-{}", static_cast<int>(::getpid()), ++number);
}

std::string device_of(const std::filesystem::path& socket) {
  return "unix:" + socket.string();
}

Log Said::log() {
  return [lines = lines_](base::LogLevel, const std::string& text) {
    const std::lock_guard lock(lines->mutex);
    lines->lines.push_back(text);
  };
}

bool Said::has(const std::string& part) const {
  const std::lock_guard lock(lines_->mutex);
  return std::any_of(lines_->lines.begin(), lines_->lines.end(),
                     [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

Rig::Rig(const std::string& device, const std::string& settings) {
  auto camera =
      V4l2Camera::open(settings_of("device = \"" + device + "\"\n" + settings), *clock_, said_.log());
  if (!camera) throw std::runtime_error(camera.error().text());
  camera_ = std::move(*camera);
  capabilities_ = camera_->capabilities();
  pixels_.resize(static_cast<std::size_t>(capabilities_.width) *
                 static_cast<std::size_t>(capabilities_.height));
}

base::Result<std::optional<FrameInfo>> Rig::wait_for_frame(std::chrono::milliseconds within) {
  base::Result<std::optional<FrameInfo>> frame;
  (void)eventually(
      [&] {
        frame = camera_->fetch(pixels_);
        return !frame || frame->has_value();
      },
      within);
  return frame;
}

base::Result<std::optional<FrameInfo>> Rig::take(double exposure_s, double gain) {
  if (auto begun = camera_->trigger(exposure_s, gain); !begun) return base::pass(begun);
  return wait_for_frame();
}

std::optional<sim::wire::VideoFacts> Rig::painted() const {
  return sim::wire::read_video(pixels_, static_cast<std::size_t>(capabilities_.width), capabilities_.bits);
}

void expect_frame(Rig& rig, double exposure_s) {
  const auto frame = rig.take(exposure_s);
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  ASSERT_TRUE(frame->has_value()) << "no frame of " << exposure_s << " s";
  const auto painted = rig.painted();
  ASSERT_TRUE(painted.has_value()) << "the pixels contradict each other";
  EXPECT_NEAR(painted->exposure_us * 1e-6, exposure_s, 1e-6);
  EXPECT_NEAR((*frame)->exposure_s, exposure_s, 1e-9);
}

}  // namespace rig::drivers::v4l2
