// The two photographs that come with libapriltag, with the corners its authors expect.
#include <OpenImageIO/imageio.h>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <regex>
#include <string>
#include <vector>

#include "calibration/fiducials/tag_finder.h"

namespace rig::calibration {
namespace {

using geometry::Vec2;
using Quad = std::array<Vec2, 4>;

struct Photograph {
  const char* name;
  std::size_t expected, found;
};

class TagPhotographs : public ::testing::TestWithParam<Photograph> {
 protected:
  void SetUp() override {
    const std::filesystem::path folder = std::filesystem::path(RIG_SHARED_DATA) / "apriltag";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no data at " << folder;
    const std::string stem = (folder / GetParam().name).string();
    auto file = OIIO::ImageInput::open(stem + ".jpg");
    ASSERT_TRUE(file) << OIIO::geterror();
    const OIIO::ImageSpec spec = file->spec();
    std::vector<float> rgb(static_cast<std::size_t>(spec.width * spec.height * spec.nchannels));
    ASSERT_TRUE(file->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, rgb.data()));
    image_ = {spec.width, spec.height, {}};
    const auto channels = static_cast<std::size_t>(spec.nchannels);
    for (std::size_t i = 0; i < rgb.size(); i += channels) {
      float sum = 0;
      for (std::size_t c = 0; c < channels; ++c) sum += rgb[i + c];
      // Grey images are linear; a square is near enough to what the camera's curve undid.
      const float grey = sum / static_cast<float>(channels);
      image_.pixels.push_back(1000 * grey * grey);
    }
    std::ifstream text(stem + ".txt");
    const std::regex number(R"(-?\d+\.\d+)");
    for (std::string line; std::getline(text, line);) {
      std::vector<double> values;
      for (std::sregex_iterator i(line.begin(), line.end(), number), end; i != end; ++i) {
        values.push_back(std::stod(i->str()));
      }
      ASSERT_EQ(values.size(), 8U) << line;
      Quad quad;
      for (std::size_t c = 0; c < 4; ++c) quad[c] = {values[2 * c] - 0.5, values[2 * c + 1] - 0.5};
      expected_.push_back(quad);
    }
    ASSERT_EQ(expected_.size(), GetParam().expected);
  }

  // The corners expected of the tag nearest to a sighting, with the corner nearest to its first put first.
  [[nodiscard]] Quad nearest(const TagSighting& sighting) const {
    Quad best{};
    double least = 1e9;
    for (const Quad& quad : expected_) {
      for (std::size_t first = 0; first < 4; ++first) {
        Quad turned;
        for (std::size_t c = 0; c < 4; ++c) turned[c] = quad[(c + first) % 4];
        const double d = worst_corner(turned, sighting.corners);
        if (d < least) least = d, best = turned;
      }
    }
    return best;
  }
  static double worst_corner(const Quad& a, const Quad& b) {
    double worst = 0;
    for (std::size_t c = 0; c < 4; ++c) worst = std::max(worst, std::hypot(a[c].x - b[c].x, a[c].y - b[c].y));
    return worst;
  }

  GreyImage image_;
  std::vector<Quad> expected_;
};

// The tags are 13 to 28 pixels wide and their authors' corners come from the same library on the photograph's
// own bytes, so that they agree to half a pixel, no better. But the mean difference of a hundred corners
// would show another pixel convention, half a pixel off in both directions.
TEST_P(TagPhotographs, AreFoundWhereTheirAuthorsSay) {
  for (const bool refine : {false, true}) {
    TagFinderOptions options;
    options.decimate = 1;
    options.refine = refine;
    auto finder = TagFinder::create("tag36h11", options);
    ASSERT_TRUE(finder);
    const auto found = finder->find(image_);
    EXPECT_EQ(found.size(), GetParam().found);
    double worst = 0, mean = 0, dx = 0, dy = 0;
    const auto count = static_cast<double>(found.size());
    for (const TagSighting& sighting : found) {
      const Quad expected = nearest(sighting);
      const double d = worst_corner(expected, sighting.corners);
      worst = std::max(worst, d);
      mean += d / count;
      for (std::size_t c = 0; c < 4; ++c) {
        dx += (sighting.corners[c].x - expected[c].x) / (4 * count);
        dy += (sighting.corners[c].y - expected[c].y) / (4 * count);
      }
    }
    std::cout << found.size() << " of " << expected_.size() << " tags: worst corner of a tag off by " << mean
              << " px on average, " << worst << " px at most; mean difference " << dx << ", " << dy
              << " px\n";
    EXPECT_LT(mean, 0.6);
    EXPECT_LT(worst, 1.5);
    EXPECT_LT(std::abs(dx), 0.2);
    EXPECT_LT(std::abs(dy), 0.2);
  }
}

INSTANTIATE_TEST_SUITE_P(Nasa, TagPhotographs,
                         ::testing::Values(Photograph{"33369213973_9d9bb4cc96_c", 12, 12},
                                           Photograph{"34085369442_304b6bafd9_c", 25, 24}));

}  // namespace
}  // namespace rig::calibration
