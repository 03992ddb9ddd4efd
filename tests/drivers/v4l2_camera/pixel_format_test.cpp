// Samples out of bytes.
#include "drivers/v4l2_camera/pixel_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

namespace rig::drivers::v4l2 {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::uint16_t> unpacked(Packing packing, const Layout& layout,
                                    const std::vector<std::uint8_t>& bytes, int shift = 0) {
  std::vector<std::uint16_t> samples(layout.width * layout.height, 0xFFFF);
  const auto done = unpack(packing, shift, layout, bytes, samples);
  EXPECT_TRUE(done.has_value()) << done.error().text();
  return samples;
}

TEST(PixelFormat, NamesAndCodesAreTheKernels) {
  EXPECT_EQ(find_pixel_format("GREY")->fourcc, V4L2_PIX_FMT_GREY);
  EXPECT_EQ(find_pixel_format("Y12")->bits, 12);
  EXPECT_EQ(find_pixel_format("SBGGR16")->fourcc, V4L2_PIX_FMT_SBGGR16) << "BYR2, not BG16";
  EXPECT_EQ(find_pixel_format("SGRBG10")->bayer, "GRBG");
  EXPECT_EQ(find_pixel_format("SRGGB12P")->packing, Packing::mipi12);
  EXPECT_EQ(find_pixel_format(V4L2_PIX_FMT_SGBRG8)->name, "SGBRG8");
  EXPECT_EQ(find_pixel_format("YUYV"), nullptr);
  EXPECT_EQ(find_pixel_format(std::uint32_t{V4L2_PIX_FMT_MJPEG}), nullptr);
  EXPECT_EQ(pixel_formats().size(), 7U + 7U * 4U);
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Y16), "Y16");
  EXPECT_EQ(fourcc_text(0x01594B4A), "JKY?");
}

TEST(PixelFormat, LinesAreTakenWithoutWhatFillsThemUp) {
  EXPECT_THAT(unpacked(Packing::bytes, {3, 2, 5}, {1, 2, 3, 99, 99, 4, 5, 6}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(unpacked(Packing::words, {2, 2, 6}, {0x01, 0x0A, 0x02, 0x0B, 9, 9, 0x03, 0x0C, 0x04, 0x0D}),
              ElementsAre(0x0A01, 0x0B02, 0x0C03, 0x0D04));
}

TEST(PixelFormat, ALeftAlignedSampleIsShifted) {
  EXPECT_THAT(unpacked(Packing::words, {2, 1, 4}, {0xF0, 0xFF, 0x10, 0x00}, 4), ElementsAre(0x0FFF, 0x0001));
}

// The last byte of a group has the low bits, the first sample's in the lowest.
TEST(PixelFormat, MipiPackingIsTheKernels) {
  EXPECT_THAT(unpacked(Packing::mipi10, {4, 1, 5}, {0xFF, 0x00, 0x80, 0x01, 0b11'10'01'00}),
              ElementsAre(0x3FC, 0x001, 0x202, 0x007));
  EXPECT_THAT(unpacked(Packing::mipi12, {2, 2, 4}, {0xFF, 0x01, 0xA3, 99, 0x00, 0x80, 0x5F, 99}),
              ElementsAre(0xFF3, 0x01A, 0x00F, 0x805));
  EXPECT_EQ(line_bytes(Packing::mipi10, 6), 10U);
  EXPECT_EQ(line_bytes(Packing::mipi12, 3), 6U);
}

TEST(PixelFormat, TooFewBytesWriteNothing) {
  std::vector<std::uint16_t> samples(6, 7);
  const std::vector<std::uint8_t> bytes(7, 1);
  const auto done = unpack(Packing::bytes, 0, {3, 2, 5}, bytes, samples);
  ASSERT_FALSE(done.has_value());
  EXPECT_THAT(done.error().text(), HasSubstr("7 bytes of an image that has 8"));
  EXPECT_THAT(samples, Each(7));
}

TEST(PixelFormat, ALayoutThatCannotBeIsDamage) {
  const std::vector<std::uint8_t> bytes(64, 1);
  std::vector<std::uint16_t> samples(6, 7);
  for (const Layout& layout : {Layout{3, 2, 2}, Layout{0, 0, 0}, Layout{3, 1, 3}, Layout{6, 2, 6}}) {
    EXPECT_FALSE(unpack(Packing::bytes, 0, layout, bytes, samples).has_value());
  }
  EXPECT_THAT(samples, Each(7));
}

TEST(PixelFormat, TheMeanLevelIsThatOfTheSamples) {
  const std::vector<std::uint8_t> grey(64 * 48, 17);
  EXPECT_DOUBLE_EQ(mean_level(Packing::bytes, {64, 48, 64}, grey), 17);
  const std::vector<std::uint8_t> words{0x00, 0x01, 0x00, 0x03};
  EXPECT_DOUBLE_EQ(mean_level(Packing::words, {2, 1, 4}, words), 0x200);
  const std::vector<std::uint8_t> packed{0xFF, 0xFF, 0xFF};
  EXPECT_DOUBLE_EQ(mean_level(Packing::mipi12, {2, 1, 3}, packed), 0xFFF);
}

}  // namespace
}  // namespace rig::drivers::v4l2
