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
  return test::settings_from(text, read_settings);
}

std::string faults_of(const std::string& text) {
  return test::faults_from(text, read_settings);
}

sim::wire::GvCameraProcess start_camera(const std::vector<std::string>& arguments) {
  auto camera = sim::wire::GvCameraProcess::start(RIG_BINARY_DIR "/bin/rig-sim-gv-camera", arguments);
  if (!camera) throw std::runtime_error(camera.error().text());
  return std::move(*camera);
}

Rig::Rig(const std::string& settings)
    : CameraRig([&](base::Clock& clock, const Log& log) {
        return GenicamCamera::open(settings_of(settings), clock, log);
      }) {}

std::optional<sim::wire::PatternFacts> Rig::painted() {
  return sim::wire::read_pattern(pixels(), width(), capabilities().bits);
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
