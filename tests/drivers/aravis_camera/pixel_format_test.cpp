// Samples out of bytes, as the naming convention (PFNC) and GigE Vision lay them.
#include "drivers/aravis_camera/pixel_format.h"

#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <numeric>

#include "core/base/random.h"
#include "sim/wire/pfnc.h"

namespace rig::drivers::aravis {
namespace {

using testing::ElementsAre;

std::vector<std::uint16_t> unpacked(Packing packing, const std::vector<std::uint8_t>& bytes,
                                    std::size_t count, int shift = 0) {
  std::vector<std::uint16_t> samples(count, 0xdead);
  const auto done = unpack(packing, shift, bytes, samples);
  EXPECT_TRUE(done.has_value()) << (done ? "" : done.error().text());
  return samples;
}

TEST(PixelFormat, BytesAreSamples) {
  EXPECT_THAT(unpacked(Packing::bytes, {0, 1, 0x7f, 0xff}, 4), ElementsAre(0, 1, 0x7f, 0xff));
}

TEST(PixelFormat, WordsHaveTheLowByteFirst) {
  EXPECT_THAT(unpacked(Packing::words, {0x34, 0x12, 0xff, 0x0f}, 2), ElementsAre(0x1234, 0x0fff));
}

TEST(PixelFormat, SamplesAtTheTopOfAWordAreShiftedDown) {
  EXPECT_THAT(unpacked(Packing::words, {0xf0, 0xff, 0x30, 0x12}, 2, 4), ElementsAre(0x0fff, 0x0123));
}

// Basler, racer GigE user's manual, 9.2.3: B0 = P0[11:4], B1 = P1[3:0] P0[3:0], B2 = P1[11:4].
TEST(PixelFormat, Mono12PackedHasBothLowNibblesInTheMiddle) {
  EXPECT_THAT(unpacked(Packing::gige_packed12, {0x12, 0x63, 0x45}, 2), ElementsAre(0x123, 0x456));
  EXPECT_THAT(unpacked(Packing::gige_packed12, {0x12, 0x63, 0x45, 0x78, 0x09}, 3),
              ElementsAre(0x123, 0x456, 0x789));
}

TEST(PixelFormat, Mono10PackedHasBothLowPairsInTheMiddle) {
  EXPECT_THAT(unpacked(Packing::gige_packed10, {0xa9, 0x21, 0x7f}, 2), ElementsAre(0x2a5, 0x1fe));
}

TEST(PixelFormat, Mono12pIsAStreamOfBits) {
  EXPECT_THAT(unpacked(Packing::pfnc_packed12, {0x23, 0x61, 0x45}, 2), ElementsAre(0x123, 0x456));
  EXPECT_THAT(unpacked(Packing::pfnc_packed12, {0x23, 0x61, 0x45, 0x89, 0x07}, 3),
              ElementsAre(0x123, 0x456, 0x789));
}

TEST(PixelFormat, Mono10pIsAStreamOfBits) {
  EXPECT_THAT(unpacked(Packing::pfnc_packed10, {0x01, 0xfc, 0x5f, 0x95, 0xaa}, 4),
              ElementsAre(0x001, 0x3ff, 0x155, 0x2aa));
  // What is left of four samples.
  EXPECT_THAT(unpacked(Packing::pfnc_packed10, {0x01, 0xfc, 0x5f, 0x95, 0xaa, 0xff, 0x03}, 5),
              ElementsAre(0x001, 0x3ff, 0x155, 0x2aa, 0x3ff));
  EXPECT_THAT(unpacked(Packing::pfnc_packed10, {0x01, 0xfc, 0x5f, 0x15}, 3),
              ElementsAre(0x001, 0x3ff, 0x155));
  EXPECT_THAT(unpacked(Packing::pfnc_packed10, {0x01, 0xfc, 0x0f}, 2), ElementsAre(0x001, 0x3ff));
}

TEST(PixelFormat, TooFewBytesAreAnErrorAndNothingIsWritten) {
  for (const Packing packing : {Packing::bytes, Packing::words, Packing::gige_packed10,
                                Packing::gige_packed12, Packing::pfnc_packed10, Packing::pfnc_packed12}) {
    for (std::size_t count = 1; count < 9; ++count) {
      std::vector<std::uint16_t> samples(count, 0xdead);
      const std::vector<std::uint8_t> bytes(bytes_of(packing, count) - 1);
      EXPECT_FALSE(unpack(packing, 0, bytes, samples).has_value());
      EXPECT_THAT(samples, testing::Each(0xdead));
    }
  }
}

TEST(PixelFormat, OfNoSamplesNothingIsUnpacked) {
  for (const PixelFormat& format : pixel_formats())
    EXPECT_TRUE(unpack(format.packing, 0, {}, {}).has_value());
}

// The simulated camera's packing was written apart from this.
TEST(PixelFormat, WhatACameraPackedComesOutOfEveryFormat) {
  for (const auto& made : sim::wire::pfnc_formats()) {
    const PixelFormat* format = find_pixel_format(made.name);
    ASSERT_NE(format, nullptr) << made.name;
    EXPECT_EQ(format->code, made.code) << made.name;
    EXPECT_EQ(format->bits, made.bits) << made.name;
    std::vector<std::uint16_t> samples(1024), back(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      samples[i] = static_cast<std::uint16_t>(base::derive_key(made.code, i) & ((1U << made.bits) - 1));
    }
    std::vector<std::uint8_t> bytes(bytes_of(format->packing, samples.size()));
    ASSERT_TRUE(sim::wire::pack_samples(made.code, samples, bytes.data()));
    ASSERT_TRUE(unpack(format->packing, 0, bytes, back).has_value());
    EXPECT_EQ(back, samples) << made.name;
  }
}

TEST(PixelFormat, CodesAreThoseOfAravis) {
  const std::map<std::string, ArvPixelFormat> known{{"Mono8", ARV_PIXEL_FORMAT_MONO_8},
                                                    {"Mono10", ARV_PIXEL_FORMAT_MONO_10},
                                                    {"Mono10Packed", ARV_PIXEL_FORMAT_MONO_10_PACKED},
                                                    {"Mono12", ARV_PIXEL_FORMAT_MONO_12},
                                                    {"Mono12Packed", ARV_PIXEL_FORMAT_MONO_12_PACKED},
                                                    {"Mono16", ARV_PIXEL_FORMAT_MONO_16},
                                                    {"BayerGR8", ARV_PIXEL_FORMAT_BAYER_GR_8},
                                                    {"BayerRG10", ARV_PIXEL_FORMAT_BAYER_RG_10},
                                                    {"BayerGB12", ARV_PIXEL_FORMAT_BAYER_GB_12},
                                                    {"BayerBG16", ARV_PIXEL_FORMAT_BAYER_BG_16},
                                                    {"BayerBG10p", ARV_PIXEL_FORMAT_BAYER_BG_10P},
                                                    {"BayerGB10p", ARV_PIXEL_FORMAT_BAYER_GB_10P},
                                                    {"BayerGR12p", ARV_PIXEL_FORMAT_BAYER_GR_12P},
                                                    {"BayerRG12p", ARV_PIXEL_FORMAT_BAYER_RG_12P},
                                                    {"BayerRG12Packed", ARV_PIXEL_FORMAT_BAYER_RG_12_PACKED},
                                                    {"BayerGB10Packed", ARV_PIXEL_FORMAT_BAYER_GB_10_PACKED}};
  for (const auto& [name, code] : known) {
    const PixelFormat* format = find_pixel_format(name);
    ASSERT_NE(format, nullptr) << name;
    EXPECT_EQ(format->code, code) << name;
  }
  EXPECT_EQ(find_pixel_format("Mono14"), nullptr);
  EXPECT_EQ(find_pixel_format("BayerRG12p")->bayer, "RGGB");
  EXPECT_EQ(find_pixel_format("BayerGB8")->bayer, "GBRG");
}

TEST(PixelFormat, NamesAndCodesAreThereOnce) {
  std::map<std::string, int> names;
  std::map<std::uint32_t, int> codes;
  for (const PixelFormat& format : pixel_formats()) {
    EXPECT_EQ(++names[format.name], 1) << format.name;
    EXPECT_EQ(++codes[format.code], 1) << format.name;
    EXPECT_EQ((format.code >> 16) & 0xff, bytes_of(format.packing, 16) * 8 / 16) << format.name;
  }
}

}  // namespace
}  // namespace rig::drivers::aravis
