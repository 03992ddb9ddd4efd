#include "tests/drivers/aravis_camera/support.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "sim/wire/own_network.h"

namespace rig::drivers::aravis {

namespace {

// Before any thread is.
const bool kOwnNetwork = sim::wire::enter_own_network();

}  // namespace

bool has_own_network() {
  return kOwnNetwork;
}

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

sim::wire::GvCameraProcess start_camera(const std::vector<std::string>& arguments) {
  auto camera = sim::wire::GvCameraProcess::start(RIG_BINARY_DIR "/bin/rig-sim-gv-camera", arguments);
  if (!camera) throw std::runtime_error(camera.error().text());
  return std::move(*camera);
}

Rig::Rig(const std::string& settings) {
  auto camera =
      GenicamCamera::open(settings_of(settings), *clock_, [](base::LogLevel, const std::string&) {});
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

std::optional<sim::wire::PatternFacts> Rig::painted() const {
  return sim::wire::read_pattern(pixels_, static_cast<std::size_t>(capabilities_.width), capabilities_.bits);
}

void expect_frame(Rig& rig, double exposure_s) {
  const auto frame = rig.take(exposure_s);
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  ASSERT_TRUE(frame->has_value()) << "no frame of " << exposure_s << " s";
  const auto painted = rig.painted();
  ASSERT_TRUE(painted.has_value()) << "the pixels contradict each other";
  EXPECT_NEAR(painted->exposure_us * 1e-6, exposure_s, 1e-6);
  EXPECT_NEAR((*frame)->exposure_s, exposure_s, 1e-6);
}

// pixel = 256 (x + y + frame) mod 65535, times 1 + log10(exposure / 10 ms), cut off at the ends.
double exposure_in_ramp(const std::vector<std::uint16_t>& pixels, int width) {
  constexpr int kSpan = 8;
  std::vector<double> steps;
  for (int x = 0; x + kSpan < width; ++x) {
    const double low = pixels[static_cast<std::size_t>(x)],
                 high = pixels[static_cast<std::size_t>(x + kSpan)];
    if (high > low && high < 65535) steps.push_back((high - low) / (256.0 * kSpan));
  }
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return 0.01 * std::pow(10.0, *middle - 1);
}

}  // namespace rig::drivers::aravis
