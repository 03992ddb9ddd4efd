// Pictures of a page: orientation, encoding, and values that no picture can show.
#include "clients/report/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "tests/clients/report/png.h"

namespace rig::report {
namespace {

using testing::ElementsAre;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

test::Png shown(const Picture& picture, double exposure) {
  const auto url = data_url(picture, exposure);
  EXPECT_TRUE(url.has_value()) << url.error().text();
  return url ? test::decoded(*url) : test::Png{};
}

TEST(DataUrl, ShowsRowZeroAtTheBottom) {
  // Bottom: red, green; middle: blue, black; top: white, half grey.
  const test::Png png = shown({2, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0.5F, 0.5F, 0.5F}}, 1);
  ASSERT_EQ(png.width, 2);
  ASSERT_EQ(png.height, 3);
  ASSERT_EQ(png.channels, 3);
  EXPECT_THAT(png.at(0, 2), ElementsAre(255, 0, 0));
  EXPECT_THAT(png.at(1, 2), ElementsAre(0, 255, 0));
  EXPECT_THAT(png.at(0, 1), ElementsAre(0, 0, 255));
  EXPECT_THAT(png.at(1, 1), ElementsAre(0, 0, 0));
  EXPECT_THAT(png.at(0, 0), ElementsAre(255, 255, 255));
  EXPECT_THAT(png.at(1, 0), ElementsAre(188, 188, 188));
}

TEST(DataUrl, EncodesAsSrgbAfterTheExposure) {
  // 0.5 is 0.7354 in sRGB, 0.001 lies on its straight part: 12.92 times 255.
  EXPECT_THAT(shown({1, 1, {0.25F, 0.0005F, 0.6F}}, 2).at(0, 0), ElementsAre(188, 3, 255));
}

TEST(DataUrl, ShowsWhatIsNoColourAsBlackOrWhite) {
  EXPECT_THAT(shown({1, 1, {kNan, kInfinity, -3}}, 1).at(0, 0), ElementsAre(0, 255, 0));
}

TEST(DataUrl, OfEverySizeIsWhole) {
  // Every length of the file modulo 3, and so every ending of base 64.
  for (int columns = 1; columns <= 40; ++columns) {
    Picture picture{columns, 1, {}};
    std::vector<unsigned char> expected;
    for (int i = 0; i < 3 * columns; ++i) {
      const bool bright = i * i % 7 < 3;
      picture.rgb.push_back(bright ? 1 : 0);
      expected.push_back(bright ? 255 : 0);
    }
    EXPECT_EQ(shown(picture, 1).pixels, expected) << columns;
  }
}

TEST(DataUrl, OfNothingIsAnError) {
  EXPECT_FALSE(data_url({0, 0, {}}, 1).has_value());
}

TEST(ColourScale, RunsFromDarkBlueToYellow) {
  const Picture scale = colour_scale({-5, 2, 3, 4, 90, kNan}, 3, 2, 2, 4);
  ASSERT_EQ(scale.rgb.size(), 18U);
  const test::Png png = shown(scale, 1);
  const auto dark = ElementsAre(69, 0, 84);
  const auto bright = ElementsAre(252, 232, 36);
  EXPECT_THAT(png.at(0, 1), dark);
  EXPECT_THAT(png.at(1, 1), dark);
  EXPECT_THAT(png.at(2, 1), ElementsAre(33, 145, 140));
  EXPECT_THAT(png.at(0, 0), bright);
  EXPECT_THAT(png.at(1, 0), bright);
  EXPECT_THAT(png.at(2, 0), dark);
}

TEST(ColourScale, OfOneValueIsOneColour) {
  const test::Png png = shown(colour_scale({3, 3, kNan, kInfinity}, 4, 1, 3, 3), 1);
  for (int x = 0; x < 4; ++x) EXPECT_THAT(png.at(x, 0), ElementsAre(69, 0, 84)) << x;
}

TEST(Percentile, IsOfTheFiniteValues) {
  EXPECT_EQ(percentile({5, kNan, 1, kInfinity, 3, -kInfinity, 2, 4}, 0.5), 3);
  EXPECT_EQ(percentile({5, kNan, 1, kInfinity, 3, 2, 4}, 0), 1);
  EXPECT_EQ(percentile({5, kNan, 1, kInfinity, 3, 2, 4}, 1), 5);
  EXPECT_EQ(percentile({kNan, 7}, 0.98), 7);
}

TEST(Percentile, OfNothingIsZero) {
  EXPECT_EQ(percentile({}, 0.5), 0);
  EXPECT_EQ(percentile({kNan, kInfinity}, 0.5), 0);
}

}  // namespace
}  // namespace rig::report
