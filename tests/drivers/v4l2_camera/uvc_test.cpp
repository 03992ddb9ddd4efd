// v4l2_camera on the kernel's own V4L2 and uvcvideo. Skipped where there is no virtual USB host controller.
#include <cmath>

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

// What each pixel is of light: the driver's gain and exposure, and the kernel's format.
TEST(UvcCameraInKernel, ExposureAndGainAreInTheLight) {
  if (!has_virtual_usb()) GTEST_SKIP() << kWhySkipped;
  UvcBench bench;
  struct Row {
    const char* format;
    std::size_t which;
    int bits;
  };
  for (const Row& row : {Row{"GREY", 0, 8}, Row{"Y12", 1, 12}, Row{"Y16", 2, 16}}) {
    SCOPED_TRACE(row.format);
    // The device is said first, then the settings without it.
    std::string rest = UvcBench::settings(row.format);
    rest.erase(0, rest.find("pixel_format"));
    Rig rig(UvcBench::kNode, rest);
    EXPECT_EQ(rig.capabilities().bits, row.bits);
    for (const double gain : {1.0, 2.5}) {
      for (const double exposure_s : {0.0105, 0.0501}) {
        const auto frame = rig.take(exposure_s, gain);
        ASSERT_TRUE(frame.has_value()) << frame.error().text();
        ASSERT_TRUE(frame->has_value()) << "no frame of " << exposure_s << " s";
        std::vector<std::uint8_t> bytes;
        for (const std::uint16_t pixel : rig.pixels())
          sim::wire::uvc_append(bytes, pixel, row.bits > 8 ? 2 : 1);
        const auto facts =
            sim::wire::read_uvc_picture(bytes, sim::wire::kUvcFormats.at(row.which), sim::wire::kUvcSizes[0]);
        ASSERT_TRUE(facts) << "the pixels contradict each other";
        EXPECT_EQ(facts->settings.exposure_100us, std::lround(exposure_s * 1e4));
        EXPECT_EQ(facts->settings.gain, std::lround(gain * 16));
        EXPECT_NEAR((*frame)->exposure_s, exposure_s, 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace rig::drivers::v4l2
