// A frame file is a plain TIFF that anybody can read, the same capture is the same bytes, and it comes back
// as it was.
#include "core/scan/frame_file.h"

#include <cstring>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/core/scan/some_frame.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan {
namespace {

using base::ErrorCode;
using namespace rig::scan::testing;
using ::testing::HasSubstr;

// A little-endian TIFF of one directory, read by its specification alone: the program's reader and writer are
// both libtiff.
class PlainTiff {
 public:
  explicit PlainTiff(std::string bytes) : bytes_(std::move(bytes)) {
    EXPECT_EQ(bytes_.substr(0, 4), std::string("II*\0", 4));
    const std::size_t directory = number(4, 4);
    const std::size_t entries = number(directory, 2);
    for (std::size_t i = 0; i < entries; ++i) {
      const std::size_t entry = directory + 2 + 12 * i;
      entries_[number(entry, 2)] = entry;
    }
    EXPECT_EQ(number(directory + 2 + 12 * entries, 4), 0U) << "a second directory";
  }

  // Of a tag with one number; `otherwise` where it is absent.
  [[nodiscard]] std::size_t value(std::size_t tag, std::size_t otherwise = 0) const {
    const auto found = entries_.find(tag);
    if (found == entries_.end()) return otherwise;
    EXPECT_EQ(number(found->second + 4, 4), 1U) << tag;
    return number(found->second + 8, number(found->second + 2, 2) == 3 ? 2 : 4);
  }

  [[nodiscard]] std::string text(std::size_t tag) const {
    const auto found = entries_.find(tag);
    if (found == entries_.end()) return {};
    const std::size_t size = number(found->second + 4, 4);
    const std::string raw = bytes_.substr(size <= 4 ? found->second + 8 : number(found->second + 8, 4), size);
    return raw.substr(0, raw.find('\0'));
  }

  [[nodiscard]] std::vector<std::uint16_t> pixels() const {
    const std::size_t offset = value(273);
    std::vector<std::uint16_t> out;
    for (std::size_t at = offset; at < offset + value(279); at += 2)
      out.push_back(static_cast<std::uint16_t>(number(at, 2)));
    return out;
  }

 private:
  [[nodiscard]] std::size_t number(std::size_t at, std::size_t size) const {
    std::size_t out = 0;
    for (std::size_t i = size; i-- > 0;) out = out << 8 | static_cast<unsigned char>(bytes_.at(at + i));
    return out;
  }

  std::string bytes_;
  std::map<std::size_t, std::size_t> entries_;
};

TEST(FrameFile, IsAPlainTiffForOtherPrograms) {
  const auto pixels = some_pixels(37, 11, 1);
  const FrameFacts facts = some_facts(123456, 2);
  const auto encoded = encode_frame(facts, 37, 11, pixels.data());
  ASSERT_TRUE(encoded.has_value()) << encoded.error().text();
  const PlainTiff tiff(as_text(*encoded));
  EXPECT_EQ(tiff.value(256), 37U);
  EXPECT_EQ(tiff.value(257), 11U);
  EXPECT_EQ(tiff.value(258), 16U);
  EXPECT_EQ(tiff.value(259), 1U) << "compression";
  EXPECT_EQ(tiff.value(262), 1U) << "black is zero";
  EXPECT_EQ(tiff.value(277, 1), 1U) << "samples of a pixel";
  EXPECT_EQ(tiff.value(339, 1), 1U) << "unsigned";
  EXPECT_EQ(tiff.text(306), "1970:01:01 00:00:00");
  EXPECT_EQ(tiff.pixels(), pixels);

  const auto json = nlohmann::json::parse(tiff.text(270));
  EXPECT_EQ(json.at("format"), 1);
  EXPECT_EQ(json.at("row"), 123456);
  EXPECT_EQ(json.at("index"), 2);
  EXPECT_NEAR(json.at("target_deg").at("roll").get<double>(), -23.1, 1e-12);
  EXPECT_NEAR(json.at("readback_deg").at("arm").get<double>(), 46.4999, 1e-12);
  EXPECT_NEAR(json.at("exposure_us").get<double>(), facts.exposure_s * 1e6, 1e-9);
  EXPECT_EQ(json.at("gain"), 1.5);
  EXPECT_EQ(json.at("bayer"), "RGGB");
  EXPECT_EQ(json.at("bits"), 12);
}

TEST(FrameFile, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  std::mt19937_64 random(test::seed(20));
  std::uniform_int_distribution<int> edge(1, 90);
  std::uniform_real_distribution<double> angle(-4, 4);
  std::uniform_real_distribution<double> exponent(-6, 2);
  for (int round = 0; round < 50; ++round) {
    FrameFacts facts = some_facts(static_cast<std::int64_t>(random() >> 20), static_cast<int>(random() % 30));
    for (std::size_t i = 0; i < machine::kAxisCount; ++i) {
      facts.target_rad[i] = angle(random);
      facts.readback_rad[i] = angle(random);
    }
    facts.exposure_s = std::pow(10.0, exponent(random));
    facts.gain = 1 + std::pow(10.0, exponent(random));
    facts.bayer = random() % 2 == 0 ? "none" : "GBRG";
    facts.bits = 8 + static_cast<int>(random() % 9);
    const int width = edge(random);
    const int height = edge(random);
    const auto pixels = some_pixels(width, height, random());
    const auto encoded = encode_frame(facts, width, height, pixels.data());
    ASSERT_TRUE(encoded.has_value()) << encoded.error().text();
    test::put_bytes(folder / "frame.tif", as_text(*encoded));

    const auto frame = read_frame(folder / "frame.tif");
    ASSERT_TRUE(frame.has_value()) << frame.error().text();
    EXPECT_EQ(frame->width, width);
    EXPECT_EQ(frame->height, height);
    EXPECT_EQ(frame->pixels, pixels);
    EXPECT_EQ(frame->facts.row, facts.row);
    EXPECT_EQ(frame->facts.index, facts.index);
    EXPECT_EQ(frame->facts.gain, facts.gain);
    EXPECT_EQ(frame->facts.bayer, facts.bayer);
    EXPECT_EQ(frame->facts.bits, facts.bits);
    // Through degrees and microseconds, so up to rounding.
    EXPECT_NEAR(frame->facts.exposure_s, facts.exposure_s, 1e-15 * facts.exposure_s * 4);
    for (std::size_t i = 0; i < machine::kAxisCount; ++i) {
      EXPECT_NEAR(frame->facts.target_rad[i], facts.target_rad[i], 4e-15);
      EXPECT_NEAR(frame->facts.readback_rad[i], facts.readback_rad[i], 4e-15);
    }
  }
}

TEST(FrameFile, TheSameCaptureIsTheSameBytes) {
  const auto pixels = some_pixels(64, 48, 2);
  const auto copy = pixels;
  const auto first = encode_frame(some_facts(3, 1), 64, 48, pixels.data());
  // What lies in memory between must not get into the file.
  { const std::vector<std::byte> rubbish(first.value().size(), std::byte{0xAB}); }
  EXPECT_EQ(first.value(), encode_frame(some_facts(3, 1), 64, 48, copy.data()).value());
  EXPECT_NE(first.value(), encode_frame(some_facts(3, 2), 64, 48, pixels.data()).value());
}

TEST(FrameFile, RefusesSizesThatNoFileHas) {
  const auto pixels = some_pixels(2, 2, 1);
  for (const auto& [width, height] : {std::pair{0, 2}, {2, 0}, {-2, 2}, {2, -1}, {65536, 1}, {1, 65536}}) {
    const auto encoded = encode_frame(some_facts(0, 0), width, height, pixels.data());
    ASSERT_FALSE(encoded.has_value()) << width << " x " << height;
    EXPECT_EQ(encoded.error().code, ErrorCode::bad_input);
  }
}

// A device may say anything; a file that could not be read back must not be written.
TEST(FrameFile, RefusesFactsThatAreNoNumbers) {
  const auto pixels = some_pixels(2, 2, 1);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const auto& spoil : std::vector<std::function<void(FrameFacts&)>>{
             [&](FrameFacts& f) { f.target_rad[0] = bad; }, [&](FrameFacts& f) { f.readback_rad[3] = bad; },
             [&](FrameFacts& f) { f.exposure_s = bad; }, [&](FrameFacts& f) { f.gain = bad; }}) {
      FrameFacts facts = some_facts(0, 0);
      spoil(facts);
      const auto encoded = encode_frame(facts, 2, 2, pixels.data());
      ASSERT_FALSE(encoded.has_value());
      EXPECT_EQ(encoded.error().code, ErrorCode::bad_input);
    }
  }
}

TEST(FrameFile, SurvivesAPatternThatIsNoText) {
  const test::TemporaryFolder folder;
  const auto pixels = some_pixels(2, 2, 1);
  FrameFacts facts = some_facts(0, 0);
  facts.bayer = std::string("RG\0\"\xFF", 5);
  const auto encoded = encode_frame(facts, 2, 2, pixels.data());
  ASSERT_TRUE(encoded.has_value()) << encoded.error().text();
  test::put_bytes(folder / "frame.tif", as_text(*encoded));
  const auto frame = read_frame(folder / "frame.tif");
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  EXPECT_EQ(frame->facts.bayer.substr(0, 4), facts.bayer.substr(0, 4));
}

}  // namespace
}  // namespace rig::scan
