#include "tests/drivers/v4l2_camera/uvc_bench.h"

#include <filesystem>
#include <gtest/gtest.h>

#include "drivers/conformance/waiting.h"
#include "drivers/v4l2_camera/devices.h"
#include "sim/wire/uvc_picture.h"

namespace rig::drivers::v4l2 {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

constexpr milliseconds kLookEvery{10};
constexpr milliseconds kFrameWithin{700};
constexpr milliseconds kLongest{128};
constexpr const sim::wire::UvcFormat& kFormat = sim::wire::kUvcFormats[2];
constexpr const sim::wire::UvcSize& kSize = sim::wire::kUvcSizes[0];

}  // namespace

bool has_virtual_usb() {
  return fs::exists(sim::wire::kVhci);
}

UvcBench::UvcBench() {
  reset();
}

UvcBench::~UvcBench() {
  end_spoiling();
  (void)cut();
}

bool UvcBench::cut() {
  plug_.unplug();
  while (fs::exists(kNode)) std::this_thread::sleep_for(kLookEvery);
  return true;
}

bool UvcBench::restore() {
  const auto done = plug_.plug();
  EXPECT_TRUE(done) << done.error().text();
  while (done && !fs::exists(kNode)) std::this_thread::sleep_for(kLookEvery);
  return done.has_value();
}

void UvcBench::reset() {
  end_spoiling();
  (void)restore();
}

std::string UvcBench::settings(const std::string& pixel_format) {
  return fmt::format(R"(
device = "{}"
pixel_format = "{}"
width = {}
height = {}
gain_unit = "factor"
gain_counts = 16
)",
                     kNode, pixel_format, kSize.width, kSize.height);
}

base::Result<std::vector<Device>> UvcBench::open() {
  const auto table = base::ConfigTable::parse(settings("Y16"), "camera.toml");
  if (!table) return base::pass(table);
  return open_devices({"v4l2", *table, "", *clock_, nullptr});
}

std::optional<conformance::CameraUnderTest> UvcBench::camera() {
  conformance::CameraUnderTest test;
  test.device = "camera";
  test.peer = this;
  test.exposures_s = {1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3, 128e-3};
  test.frame_within = kFrameWithin;
  return test;
}

std::optional<double> UvcBench::exposure_in(std::span<const std::uint16_t> pixels) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint16_t pixel : pixels) sim::wire::uvc_append(bytes, pixel, 2);
  const auto facts = sim::wire::read_uvc_picture(bytes, kFormat, kSize);
  // Pixels that contradict each other are no exposure.
  return facts ? facts->settings.exposure_100us * 100e-6 : -1;
}

bool UvcBench::corrupt_next() {
  spoil_all(&sim::wire::UvcCamera::damage_frames);
  return true;
}

bool UvcBench::drop_next() {
  spoil_all(&sim::wire::UvcCamera::drop_frames);
  return true;
}

void UvcBench::spoil_all(void (sim::wire::UvcCamera::*how)(int)) {
  end_spoiling();
  constexpr int kMany = 1'000'000;
  (camera_.*how)(kMany);
  const auto end = std::chrono::steady_clock::now() +
                   (kLongest + kFrameWithin + milliseconds(200)) * conformance::patience();
  ending_ = false;
  spoiling_ = std::thread([this, how, end] {
    std::unique_lock lock(mutex_);
    enough_.wait_until(lock, std::chrono::time_point_cast<std::chrono::steady_clock::duration>(end),
                       [this] { return ending_; });
    (camera_.*how)(0);
  });
}

void UvcBench::end_spoiling() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  enough_.notify_all();
  if (spoiling_.joinable()) spoiling_.join();
}

}  // namespace rig::drivers::v4l2
