// Frame files that are damaged, cut short, foreign or newer: an error that names the file, never a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include "tests/core/scan/some_frame.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan {
namespace {

using base::ErrorCode;
using namespace rig::scan::testing;
using ::testing::HasSubstr;

class FrameDamage : public ::testing::Test {
 protected:
  [[nodiscard]] base::Result<Frame> reading(const std::string& bytes) const {
    put_anew(path(), bytes);
    return read_frame(path());
  }
  void expect_refused(const std::string& bytes, ErrorCode code, const std::string& said) const {
    const auto frame = reading(bytes);
    ASSERT_FALSE(frame.has_value()) << said;
    EXPECT_EQ(frame.error().code, code) << frame.error().text();
    EXPECT_EQ(frame.error().where, path().string());
    EXPECT_THAT(frame.error().what, HasSubstr(said));
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "frame.tif"; }

  const test::TemporaryFolder folder_;
  const std::string good_ = some_frame_bytes();
};

TEST_F(FrameDamage, AMissingFileIsNotFound) {
  const auto frame = read_frame(path());
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::not_found);
  EXPECT_EQ(frame.error().where, path().string());
}

TEST_F(FrameDamage, EveryCutIsFound) {
  ASSERT_TRUE(reading(good_).has_value());
  for (std::size_t size = 0; size < good_.size(); ++size) {
    const auto frame = reading(good_.substr(0, size));
    // A file may end behind its last byte that matters, such as one of padding.
    if (frame.has_value()) {
      EXPECT_GE(size + 2, good_.size());
      EXPECT_EQ(frame->pixels, some_pixels(7, 5, 3));
      continue;
    }
    EXPECT_EQ(frame.error().code, ErrorCode::damaged) << size << ": " << frame.error().text();
  }
}

TEST_F(FrameDamage, NoFlippedBitDoesHarm) {
  std::size_t refused = 0;
  for (std::size_t at = 0; at < good_.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string bytes = good_;
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
      const auto frame = reading(bytes);
      if (!frame) {
        EXPECT_EQ(frame.error().where, path().string());
        ++refused;
        continue;
      }
      // Not every bit shows: pixels and numbers may be any. What is returned is at least whole.
      EXPECT_EQ(frame->pixels.size(),
                static_cast<std::size_t>(frame->width) * static_cast<std::size_t>(frame->height));
      EXPECT_LE(frame->pixels.size() * 2, bytes.size());
    }
  }
  EXPECT_GT(refused, 1000U);
}

TEST_F(FrameDamage, NoRubbishDoesHarm) {
  std::mt19937_64 random(test::seed(7));
  for (int round = 0; round < 2000; ++round) {
    std::string bytes = good_;
    const std::size_t from = random() % bytes.size();
    const std::size_t length = std::min<std::size_t>(1 + random() % 40, bytes.size() - from);
    for (std::size_t i = 0; i < length; ++i) bytes[from + i] = static_cast<char>(random());
    const auto frame = reading(bytes);
    if (frame) {
      EXPECT_EQ(frame->pixels.size(),
                static_cast<std::size_t>(frame->width) * static_cast<std::size_t>(frame->height));
    }
  }
}

TEST_F(FrameDamage, ASizeBeyondTheFileIsNotBelieved) {
  // Width and height are in the directory as SHORT or LONG: both numbers are found as such.
  std::string bytes = good_;
  const auto set = [&bytes](int tag, int value) {
    const std::string entry{static_cast<char>(tag & 0xFF), static_cast<char>(tag >> 8)};
    for (std::size_t at = 8; (at = bytes.find(entry, at)) != std::string::npos; ++at) {
      const char type = bytes[at + 2];
      if ((type != 3 && type != 4) || bytes.substr(at + 4, 4) != std::string("\1\0\0\0", 4)) continue;
      bytes[at + 8] = static_cast<char>(value & 0xFF);
      bytes[at + 9] = static_cast<char>(value >> 8);
      return;
    }
    FAIL() << "no tag " << tag;
  };
  set(256, 65535);
  set(257, 65535);
  expect_refused(bytes, ErrorCode::damaged, "cut short");
}

TEST_F(FrameDamage, ANewerFormatIsSaidToBeNewer) {
  expect_refused(with_replaced(good_, "\"format\":1", "\"format\":2"), ErrorCode::newer, "frame format 2");
}

TEST_F(FrameDamage, FactsThatAreMissingOrOfAnotherKindAreDamage) {
  const std::string said = "ImageDescription";
  expect_refused(with_replaced(good_, "{\"format\"", "[\"format\""), ErrorCode::damaged, said);
  expect_refused(with_replaced(good_, "\"format\":1", "\"fOrmat\":1"), ErrorCode::damaged, said);
  expect_refused(with_replaced(good_, "\"row\":12", "\"row\":{}"), ErrorCode::damaged, said);
  expect_refused(with_replaced(good_, "\"bits\":12", "\"bits\":[]"), ErrorCode::damaged, said);
  expect_refused(with_replaced(good_, "\"bayer\":\"RGGB\"", "\"bayer\": 12345"), ErrorCode::damaged, said);
  expect_refused(with_replaced(good_, "\"target_deg\"", "\"turget_deg\""), ErrorCode::damaged, said);
  expect_refused(with_replaced(good_, "\"RGGB\"", "\"RG\xFF\xFE\""), ErrorCode::damaged, said);
}

// Files of other programs, through libtiff as those would be.
class ForeignTiff : public FrameDamage {
 protected:
  struct Kind {
    const char* mode = "w";
    std::uint16_t bits = 16, samples = 1, compression = COMPRESSION_NONE;
    std::uint32_t rows_per_strip = 5;
    bool described = true;
    bool tiled = false;
  };

  // 7 x 5 pixels of some_pixels(7, 5, 3), with the description of a good frame.
  void write(const Kind& kind) const {
    test::put_bytes(path(), good_);
    const std::size_t begin = good_.find("{\"format\"");
    const std::string description = good_.substr(begin, good_.find('\0', begin) - begin);
    const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(TIFFOpen(path().c_str(), kind.mode), &TIFFClose);
    ASSERT_NE(tiff, nullptr);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, 7);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, 5);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, kind.bits);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, kind.samples);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, kind.compression);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC,
                 kind.samples == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    if (kind.described) TIFFSetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    if (kind.tiled) {
      TIFFSetField(tiff.get(), TIFFTAG_TILEWIDTH, 16);
      TIFFSetField(tiff.get(), TIFFTAG_TILELENGTH, 16);
      std::vector<std::uint16_t> tile(16 * 16, 9);
      ASSERT_GT(TIFFWriteEncodedTile(tiff.get(), 0, tile.data(), 16 * 16 * 2), 0);
      return;
    }
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, kind.rows_per_strip);
    const auto pixels = some_pixels(7 * kind.samples, 5, 3);
    for (std::uint32_t y = 0; y < 5; ++y) {
      auto row = std::vector<std::uint16_t>(pixels.begin() + y * 7 * kind.samples,
                                            pixels.begin() + (y + 1) * 7 * kind.samples);
      ASSERT_EQ(TIFFWriteScanline(tiff.get(), row.data(), y), 1);
    }
  }

  void expect_refused(ErrorCode code, const std::string& said) const {
    const auto frame = read_frame(path());
    ASSERT_FALSE(frame.has_value()) << said;
    EXPECT_EQ(frame.error().code, code) << frame.error().text();
    EXPECT_THAT(frame.error().text(), HasSubstr(said));
  }
};

TEST_F(ForeignTiff, OfTheSameContentIsReadWhateverItsLayout) {
  for (const char* mode : {"wl", "wb", "w8"}) {
    for (const std::uint32_t rows : {1U, 2U, 5U}) {
      Kind kind;
      kind.mode = mode;
      kind.rows_per_strip = rows;
      write(kind);
      const auto frame = read_frame(path());
      ASSERT_TRUE(frame.has_value()) << mode << " " << rows << ": " << frame.error().text();
      EXPECT_EQ(frame->pixels, some_pixels(7, 5, 3)) << mode << " " << rows;
      EXPECT_EQ(frame->facts.row, 12);
    }
  }
}

TEST_F(ForeignTiff, OfAnotherKindIsRefused) {
  Kind eight_bits;
  eight_bits.bits = 8;
  write(eight_bits);
  expect_refused(ErrorCode::bad_input, "16 bits");

  Kind colour;
  colour.samples = 3;
  write(colour);
  expect_refused(ErrorCode::bad_input, "one channel");

  Kind compressed;
  compressed.compression = COMPRESSION_LZW;
  write(compressed);
  expect_refused(ErrorCode::bad_input, "uncompressed");

  Kind undescribed;
  undescribed.described = false;
  write(undescribed);
  expect_refused(ErrorCode::damaged, "ImageDescription");

  Kind tiled;
  tiled.tiled = true;
  write(tiled);
  expect_refused(ErrorCode::damaged, "cannot be read to the end");
}

}  // namespace
}  // namespace rig::scan
