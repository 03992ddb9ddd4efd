// Stacks made in a temporary folder from known materials, through the layouts of the field, back to the known
// values.
#include "clients/import/import.h"

#include <OpenImageIO/imageio.h>
#include <cmath>
#include <gtest/gtest.h>

#include "core/geometry/sample_grid.h"
#include "core/geometry/vec.h"
#include "tests/core/temporary_folder.h"

namespace rig::import {

namespace {

using geometry::Vec3;
using test::put_bytes;
using test::TemporaryFolder;

constexpr int kSize = 24;
constexpr double kWidth_m = 0.06;

// Albedo that varies over the sample, so that a flipped or turned import shows.
double known_brdf(Vec3 point, std::size_t channel) {
  return 0.08 + 0.5 * (point.x / kWidth_m + 0.5) * (channel == 0 ? 1 : 0.5) +
         0.2 * (point.y / kWidth_m + 0.5);
}

double srgb(double v) {
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

// What a camera with this encoding stores of `light(x, y, channel)`; the first line is the top of the sample.
template <typename Light>
void write_png(const std::filesystem::path& file, OIIO::TypeDesc type, bool as_srgb, Light light) {
  const geometry::SampleGrid grid{kSize, kSize, kWidth_m, kWidth_m};
  std::vector<float> pixels;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = light(grid.centre(x, kSize - 1 - y), c);
        pixels.push_back(static_cast<float>(as_srgb ? srgb(value) : value));
      }
    }
  }
  auto out = OIIO::ImageOutput::create(file.string());
  ASSERT_TRUE(out);
  ASSERT_TRUE(out->open(file.string(), OIIO::ImageSpec(kSize, kSize, 3, type)));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
  ASSERT_TRUE(out->close());
}

// Three photographs with the light at three places, in centimetres.
void write_positions_stack(const std::filesystem::path& folder, bool as_srgb) {
  const std::vector<Vec3> lights{{0.01, 0.02, 0.17}, {-0.05, 0.03, 0.15}, {0.08, -0.06, 0.12}};
  std::string positions;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Vec3 light = lights[i];
    positions += fmt::format("{},{},{}\n", 100 * light.x, 100 * light.y, 100 * light.z);
    write_png(folder / fmt::format("{:02}.png", i), OIIO::TypeDesc::UINT16, as_srgb,
              [&](Vec3 point, std::size_t c) {
                const Vec3 way = light - point;
                const double r = std::sqrt(geometry::dot(way, way));
                return known_brdf(point, c) * 0.02 * way.z / (r * r * r);
              });
  }
  put_bytes(folder / "camera_pos.txt", positions);
  put_bytes(folder / "light_pos.txt", positions);
  put_bytes(folder / "image_size.txt", "6.0\n");
  // The irradiance at one centimetre is 10^4 times that at one metre.
  put_bytes(folder / "light_power.txt", "200,200,200\n");
}

ImportOptions options_for(const std::filesystem::path& out, const std::string& encoding) {
  ImportOptions options;
  options.out = out;
  options.name = "known";
  options.encoding = parse_encoding(encoding).value();
  return options;
}

void expect_known(const std::filesystem::path& map, int columns, double tolerance) {
  auto reader = maps::ObservationReader::open(map);
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  const auto& header = reader->header();
  EXPECT_EQ(header.columns, columns);
  EXPECT_NEAR(header.width_m, kWidth_m, 1e-9);
  const geometry::SampleGrid grid{header.columns, header.rows, header.width_m, header.height_m};
  const auto block = reader->read(0, header.rows, 0, header.columns).value();
  for (int t = 0; t < header.rows; ++t) {
    for (int s = 0; s < header.columns; ++s) {
      for (std::size_t p = 0; p < header.poses.size(); ++p) {
        const std::size_t at = block.texel_index(t, s) + p;
        ASSERT_EQ(block.validity[at], maps::Validity::good);
        for (std::size_t c = 0; c < 3; ++c) {
          const double truth = known_brdf(grid.centre(s, t), c);
          ASSERT_NEAR(static_cast<double>(block.value[3 * at + c]), truth, tolerance * truth)
              << "texel " << s << " " << t << " pose " << p;
          ASSERT_GT(block.variance[3 * at + c], 0);
        }
      }
    }
  }
}

}  // namespace

TEST(Import, PositionsGiveBackTheKnownReflectance) {
  for (const bool as_srgb : {true, false}) {
    TemporaryFolder folder;
    write_positions_stack(folder.path(), as_srgb);
    auto stack = read_positions_layout(folder.path(), 0.01);
    ASSERT_TRUE(stack.has_value()) << stack.error().text();
    ASSERT_EQ(stack->photographs.size(), 3U);
    const auto summary = import_stack(*stack, options_for(folder / "map.h5", as_srgb ? "srgb" : "linear"));
    ASSERT_TRUE(summary.has_value()) << summary.error().text();
    expect_known(folder / "map.h5", kSize, 0.002);
  }
}

TEST(Import, FewerTexelsAreMeansOfTheirArea) {
  TemporaryFolder folder;
  write_positions_stack(folder.path(), true);
  auto stack = read_positions_layout(folder.path(), 0.01);
  ASSERT_TRUE(stack.has_value());
  for (const int columns : {8, 7}) {
    auto options = options_for(folder / "map.h5", "srgb");
    options.columns = columns;
    ASSERT_TRUE(import_stack(*stack, options).has_value());
    // The light and the albedo both vary within a texel: the mean of their product is not theirs.
    expect_known(folder / "map.h5", columns, 0.02);
  }
}

TEST(Import, LittleMemoryMakesTheSameMap) {
  TemporaryFolder folder;
  write_positions_stack(folder.path(), true);
  auto stack = read_positions_layout(folder.path(), 0.01);
  ASSERT_TRUE(stack.has_value());
  auto options = options_for(folder / "map.h5", "srgb");
  options.memory_mib = 0;
  ASSERT_TRUE(import_stack(*stack, options).has_value());
  expect_known(folder / "map.h5", kSize, 0.002);
}

TEST(Import, RtiDirectionsGiveBackTheKnownReflectance) {
  TemporaryFolder folder;
  const std::vector<Vec3> lights{{0, 0, 2}, {0.5, 0.2, 0.7}, {-0.6, 0.1, 0.4}};
  std::string lp = "3\n";
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const std::string name = fmt::format("shot {}.png", i);
    lp += fmt::format("C:\\dome\\{} {} {} {}\n", name, lights[i].x, lights[i].y, lights[i].z);
    const double cosine = geometry::normalized(lights[i]).z;
    write_png(folder / name, OIIO::TypeDesc::UINT16, false,
              [&](Vec3 point, std::size_t c) { return known_brdf(point, c) * cosine; });
  }
  put_bytes(folder / "dome.lp", lp);
  const auto found = find_layout(folder.path());
  ASSERT_TRUE(found.has_value()) << found.error().text();
  EXPECT_EQ(found->layout, Layout::lp);
  auto stack = read_lp_layout(found->path, 0.6);
  ASSERT_TRUE(stack.has_value()) << stack.error().text();
  EXPECT_FALSE(import_stack(*stack, options_for(folder / "map.h5", "linear")).has_value())
      << "no width was given";
  stack->width_m = kWidth_m;
  const auto summary = import_stack(*stack, options_for(folder / "map.h5", "linear"));
  ASSERT_TRUE(summary.has_value()) << summary.error().text();
  expect_known(folder / "map.h5", kSize, 0.002);
}

TEST(Import, TheEndsOfTheRangeAreMarked) {
  TemporaryFolder folder;
  write_positions_stack(folder.path(), false);
  // One white pixel and one black one in the first photograph, at the top left and at the bottom right.
  write_png(folder / "00.png", OIIO::TypeDesc::UINT8, false, [](Vec3 point, std::size_t) {
    const double edge = kWidth_m / 2 - kWidth_m / kSize;
    if (point.x < -edge && point.y > edge) return 1.0;
    if (point.x > edge && point.y < -edge) return 0.0;
    return 0.5;
  });
  auto stack = read_positions_layout(folder.path(), 0.01);
  ASSERT_TRUE(stack.has_value());
  ASSERT_TRUE(import_stack(*stack, options_for(folder / "map.h5", "linear")).has_value());
  const auto block = maps::ObservationReader::open(folder / "map.h5")->read(0, kSize, 0, kSize).value();
  EXPECT_EQ(block.validity[block.texel_index(kSize - 1, 0)], maps::Validity::saturated);
  EXPECT_EQ(block.validity[block.texel_index(0, kSize - 1)], maps::Validity::dark);
  EXPECT_EQ(block.validity[block.texel_index(5, 5)], maps::Validity::good);
}

TEST(Import, MistakesAreNamedWithFileAndLineAndLeaveNothing) {
  struct Mistake {
    const char* file;
    const char* content;
    const char* said;
  };
  for (const Mistake& m : std::vector<Mistake>{
           {"camera_pos.txt", "1,2,17\n1,2\n1,2,17\n", "camera_pos.txt:2: has 2 values"},
           {"camera_pos.txt", "1,2,17\n1,2,nan\n1,2,17\n", "camera_pos.txt:2: 'nan' is not a number"},
           {"light_pos.txt", "1,2,17\n1,2,-3\n1,2,17\n", "light_pos.txt:2: z = -3 is not above"},
           {"light_pos.txt", "1,2,17\n1,2,3\n", "3 camera positions, 2 light positions and 3 images"},
           {"image_size.txt", "0\n", "image_size.txt:1: 0 is not positive"},
           {"light_power.txt", "1,1,1\n1,1,1\n", "light_power.txt: has 2 lines"},
           {"01.png", "not an image", "01.png"}}) {
    TemporaryFolder folder;
    write_positions_stack(folder.path(), true);
    put_bytes(folder / m.file, m.content);
    const auto before = test::everything_in(folder.path());
    const auto stack = read_positions_layout(folder.path(), 0.01);
    std::string said;
    if (!stack) {
      said = stack.error().text();
    } else {
      const auto made = import_stack(*stack, options_for(folder / "map.h5", "srgb"));
      ASSERT_FALSE(made.has_value()) << m.said;
      said = made.error().text();
    }
    EXPECT_NE(said.find(m.said), std::string::npos) << said;
    EXPECT_EQ(test::everything_in(folder.path()), before);
  }
}

TEST(Import, ATruncatedPhotographLeavesNoMap) {
  TemporaryFolder folder;
  write_positions_stack(folder.path(), true);
  const std::string whole = test::bytes_in(folder / "02.png");
  put_bytes(folder / "02.png", whole.substr(0, whole.size() / 2));
  const auto before = test::everything_in(folder.path());
  auto stack = read_positions_layout(folder.path(), 0.01);
  ASSERT_TRUE(stack.has_value());
  const auto made = import_stack(*stack, options_for(folder / "map.h5", "srgb"));
  ASSERT_FALSE(made.has_value());
  EXPECT_NE(made.error().text().find("02.png"), std::string::npos) << made.error().text();
  EXPECT_EQ(test::everything_in(folder.path()), before);
}

TEST(Import, LpMistakesAreNamed) {
  struct Mistake {
    const char* content;
    const char* said;
  };
  for (const Mistake& m : std::vector<Mistake>{{"", "is empty"},
                                               {"2\na.png 0 0 1\n", "promises 2 images, 1 lines follow"},
                                               {"1\na.png 0 0\n", ":2: has 3 values"},
                                               {"1\na.png 0 0 0\n", ":2: the light has no direction"},
                                               {"1\na.png 0 0 1\n", ":2: there is no image 'a.png'"},
                                               {"0\n", "names no image"}}) {
    TemporaryFolder folder;
    put_bytes(folder / "x.lp", m.content);
    const auto stack = read_lp_layout(folder / "x.lp", 1);
    ASSERT_FALSE(stack.has_value());
    EXPECT_NE(stack.error().text().find(m.said), std::string::npos) << stack.error().text();
  }
  TemporaryFolder nothing;
  EXPECT_FALSE(find_layout(nothing.path()).has_value());
  EXPECT_FALSE(find_layout(nothing / "absent").has_value());
}

TEST(Import, EncodingsAreInverseAndTheirSlopesAreDerivatives) {
  for (const char* name : {"linear", "srgb", "gamma:2.2"}) {
    const auto encoding = parse_encoding(name);
    ASSERT_TRUE(encoding.has_value());
    EXPECT_EQ(text_of(*encoding), name);
    EXPECT_NEAR(decoded(*encoding, 1), 1, 1e-12);
    EXPECT_NEAR(decoded(*encoding, 0), 0, 1e-12);
    for (double code = 0.01; code < 1; code += 0.0317) {
      const double numeric = (decoded(*encoding, code + 1e-6) - decoded(*encoding, code - 1e-6)) / 2e-6;
      EXPECT_NEAR(decoded_slope(*encoding, code), numeric, 1e-5) << name << " " << code;
    }
  }
  EXPECT_NEAR(decoded(parse_encoding("srgb").value(), srgb(0.3)), 0.3, 1e-12);
  for (const char* bad : {"", "gamma", "gamma:", "gamma:0", "gamma:2.2x", "raw"}) {
    EXPECT_FALSE(parse_encoding(bad).has_value()) << bad;
  }
}

}  // namespace rig::import
