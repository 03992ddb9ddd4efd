// Pictures of a page, back from their data URLs.
#pragma once

#include <gtest/gtest.h>
#include <string>
#include <vector>

// Last: it defines macros that hide the byte swaps of the system.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace rig::test {

struct Png {
  int width = 0, height = 0, channels = 0;
  std::vector<unsigned char> pixels;

  /// Column x of line y, from the top.
  [[nodiscard]] std::vector<int> at(int x, int y) const {
    const auto first = pixels.begin() + static_cast<std::ptrdiff_t>((y * width + x) * channels);
    return {first, first + channels};
  }
};

inline std::string bytes_of_base64(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  EXPECT_EQ(text.size() % 4, 0U);
  std::string bytes;
  unsigned group = 0;
  int bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const auto digit = kDigits.find(c);
    EXPECT_NE(digit, std::string::npos) << c;
    group = ((group << 6) | static_cast<unsigned>(digit)) & 0xffffU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>((group >> bits) & 0xffU);
  }
  return bytes;
}

inline Png decoded(const std::string& url) {
  const std::string prefix = "data:image/png;base64,";
  EXPECT_EQ(url.substr(0, prefix.size()), prefix);
  std::string bytes = bytes_of_base64(url.substr(prefix.size()));
  OIIO::Filesystem::IOMemReader source(bytes.data(), bytes.size());
  auto in = OIIO::ImageInput::open("picture.png", nullptr, &source);
  EXPECT_TRUE(in) << OIIO::geterror();
  if (!in) return {};
  Png png{in->spec().width, in->spec().height, in->spec().nchannels, {}};
  png.pixels.resize(static_cast<std::size_t>(png.width * png.height * png.channels));
  EXPECT_TRUE(in->read_image(0, 0, 0, png.channels, OIIO::TypeDesc::UINT8, png.pixels.data()))
      << in->geterror();
  return png;
}

}  // namespace rig::test
