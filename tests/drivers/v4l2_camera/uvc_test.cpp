// v4l2_camera on the kernel's own V4L2 and uvcvideo. Skipped where there is no virtual USB host controller.
#include <cmath>
#include <gmock/gmock.h>

#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/v4l2_camera/support.h"
#include "tests/drivers/v4l2_camera/uvc_bench.h"

namespace rig::drivers::v4l2 {
namespace {

constexpr const char* kWhySkipped = "no virtual USB host controller (vhci-hcd); tests/kernel has one";

std::vector<std::size_t> checks_of_cameras() {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < conformance::checks().size(); ++i) {
    if (conformance::checks()[i].name.starts_with("camera")) numbers.push_back(i);
  }
  return numbers;
}

class UvcConformance : public conformance::ConformanceTest {};

TEST_P(UvcConformance, Passes) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  run(std::make_unique<UvcBench>(), conformance::checks()[GetParam()]);
}

INSTANTIATE_TEST_SUITE_P(conformance, UvcConformance, testing::ValuesIn(checks_of_cameras()),
                         conformance::test_name_of);

struct Row {
  const char* format;
  std::size_t which;
  int bits;
};
constexpr Row kGrey{"GREY", 0, 8}, kTwelve{"Y12", 1, 12}, kSixteen{"Y16", 2, 16};

// The device is said first, then the settings without it.
std::string settings_without_device(const Row& row) {
  std::string rest = UvcBench::settings(row.format);
  rest.erase(0, rest.find("pixel_format"));
  return rest;
}

// Every sample is what exposure and gain make of the light.
void expect_light(Rig& rig, const Row& row, double exposure_s, double gain) {
  SCOPED_TRACE(testing::Message() << row.format << ", " << exposure_s << " s, gain " << gain);
  const auto frame = rig.take(exposure_s, gain);
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  ASSERT_TRUE(frame->has_value()) << "no frame";
  std::vector<std::uint8_t> bytes;
  for (const std::uint16_t pixel : rig.pixels()) sim::wire::uvc_append(bytes, pixel, row.bits > 8 ? 2 : 1);
  const auto facts =
      sim::wire::read_uvc_picture(bytes, sim::wire::kUvcFormats.at(row.which), sim::wire::kUvcSizes[0]);
  ASSERT_TRUE(facts) << "the pixels contradict each other";
  EXPECT_EQ(facts->settings.exposure_100us, std::lround(exposure_s * 1e4));
  EXPECT_EQ(facts->settings.gain, std::lround(gain * 16));
  EXPECT_NEAR((*frame)->exposure_s, exposure_s, 1e-9);
}

TEST(UvcCameraInKernel, ExposureAndGainAreInTheLight) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  const UvcBench bench;
  for (const Row& row : {kGrey, kTwelve, kSixteen}) {
    Rig rig(UvcBench::kNode, settings_without_device(row));
    EXPECT_EQ(rig.capabilities().bits, row.bits);
    for (const double gain : {1.0, 2.5}) {
      for (const double exposure_s : {0.0105, 0.0501}) expect_light(rig, row, exposure_s, gain);
    }
  }
}

// The driver measures how long a setting takes.
TEST(UvcCameraInKernel, ASensorWithALongPipeline) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  UvcBench bench;
  bench.device().set_settings_delay(5);
  Rig rig(UvcBench::kNode, settings_without_device(kSixteen));
  for (int i = 0; i < 2; ++i) {
    for (const double exposure_s : {0.1, 0.001, 0.02}) expect_light(rig, kSixteen, exposure_s, 1 + i);
  }
}

// A camera that is not ready for a control is asked again, and nobody hears of it.
TEST(UvcCameraInKernel, ACameraThatIsNotReadyIsAskedAgain) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  UvcBench bench;
  Rig rig(UvcBench::kNode, settings_without_device(kSixteen));
  expect_light(rig, kSixteen, 0.02, 1);
  const int before = bench.device().state().stalled;
  bench.device().stall_requests(2, sim::wire::UvcError::not_ready);
  expect_light(rig, kSixteen, 0.01, 1);
  EXPECT_EQ(bench.device().state().stalled, before + 2);
}

// The camera refuses a control: an error says so, and afterwards all is well.
TEST(UvcCameraInKernel, ARequestThatStalls) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  UvcBench bench;
  Rig rig(UvcBench::kNode, settings_without_device(kSixteen));
  expect_light(rig, kSixteen, 0.02, 1);
  bench.device().stall_requests(1, sim::wire::UvcError::wrong_state);
  const auto refused = rig.take(0.01, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text(), testing::HasSubstr("in its present state"));
  EXPECT_TRUE(eventually([&] {
    (void)rig.camera().abort();
    return rig.camera().arm().has_value() && rig.camera().trigger(0.01, 1).has_value();
  }));
  (void)rig.camera().abort();
  expect_light(rig, kSixteen, 0.01, 1);
}

}  // namespace
}  // namespace rig::drivers::v4l2
