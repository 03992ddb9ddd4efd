// Parameter maps: what was written is what is read, and what other programs see.
#include "core/maps/parameter_map.h"

#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::maps {
namespace {

using base::Error;
using base::ErrorCode;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kColumns = 23;
constexpr int kRows = 19;

ParameterMap sample_map() {
  ParameterMap map;
  map.columns = kColumns;
  map.rows = kRows;
  map.width_m = 0.16;
  map.height_m = 0.1;
  map.model = "lafortune";
  map.attributes = {{"units.rho_d", "1"},
                    {"provenance.program", "rig-fit 0.1"},
                    {"a.name.of.more.than.thirty.one.letters", "Köper"}};
  float next = 0;
  for (const char* name :
       {"rho_d.R", "lobe1.Cx", "lobe1.n", "residual", "a.channel.of.more.than.thirty.letters"}) {
    Channel& channel = map.add(name);
    for (float& v : channel.values) v = next += 0.25F;
  }
  map.channels[1].values[5] = std::numeric_limits<float>::quiet_NaN();
  map.channels[2].values[6] = std::numeric_limits<float>::infinity();
  map.channels[2].values[7] = -0.0F;
  return map;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](float x, float y) {
           return std::memcmp(&x, &y, sizeof x) == 0;
         });
}

class ParameterMaps : public testing::Test {
 protected:
  [[nodiscard]] Error refusal() const {
    const auto map = read_parameter_map(path_);
    EXPECT_FALSE(map.has_value());
    if (map) return {};
    EXPECT_EQ(map.error().where, path_.string());
    return map.error();
  }

  // A file of OpenEXR that somebody else wrote.
  void write_foreign(Imf::Header header) const {
    header.channels().insert("x", Imf::Channel(Imf::FLOAT));
    std::vector<float> values(16, 1.0F);
    Imf::FrameBuffer buffer;
    buffer.insert("x", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 16));
    Imf::OutputFile file(path_.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(4);
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "map.exr";
};

TEST_F(ParameterMaps, ComeBackToTheBit) {
  const ParameterMap map = sample_map();
  ASSERT_TRUE(write_parameter_map(path_, map).has_value());
  EXPECT_THAT(test::everything_in(folder_.path()), ElementsAre("map.exr"));
  const auto read = read_parameter_map(path_);
  ASSERT_TRUE(read.has_value()) << read.error().text();
  EXPECT_EQ(read->columns, map.columns);
  EXPECT_EQ(read->rows, map.rows);
  EXPECT_EQ(read->width_m, map.width_m);
  EXPECT_EQ(read->height_m, map.height_m);
  EXPECT_EQ(read->model, map.model);
  EXPECT_EQ(read->attributes, map.attributes);
  ASSERT_EQ(read->channels.size(), map.channels.size());
  for (const Channel& c : map.channels) {
    const Channel* found = read->find(c.name);
    ASSERT_NE(found, nullptr) << c.name;
    EXPECT_TRUE(same_bits(found->values, c.values)) << c.name;
  }
  EXPECT_EQ(read->find("no such channel"), nullptr);
}

TEST_F(ParameterMaps, TheSameMapIsTheSameBytesInAnyOrderOfChannels) {
  ParameterMap map = sample_map();
  ASSERT_TRUE(write_parameter_map(path_, map).has_value());
  const std::string first = test::bytes_in(path_);
  std::reverse(map.channels.begin(), map.channels.end());
  ASSERT_TRUE(write_parameter_map(path_, map).has_value());
  EXPECT_EQ(first, test::bytes_in(path_));
}

TEST_F(ParameterMaps, TheFirstScanLineIsTheUpperEdgeOfTheSample) {
  ParameterMap map = sample_map();
  for (int t = 0; t < kRows; ++t) {
    for (int s = 0; s < kColumns; ++s) {
      map.channels[0].values[static_cast<std::size_t>(t * kColumns + s)] = static_cast<float>(100 * t + s);
    }
  }
  ASSERT_TRUE(write_parameter_map(path_, map).has_value());
  Imf::InputFile file(path_.c_str());
  std::vector<float> pixels(static_cast<std::size_t>(kColumns) * kRows);
  Imf::FrameBuffer buffer;
  buffer.insert("rho_d.R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels.data()), 4, 4 * kColumns));
  file.setFrameBuffer(buffer);
  file.readPixels(0, kRows - 1);
  for (int line = 0; line < kRows; ++line) {
    for (int s = 0; s < kColumns; ++s) {
      ASSERT_EQ(pixels[static_cast<std::size_t>(line * kColumns + s)],
                static_cast<float>(100 * (kRows - 1 - line) + s));
    }
  }
  EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
  const auto* units = file.header().findTypedAttribute<Imf::StringAttribute>("rigd.attribute.units.rho_d");
  ASSERT_NE(units, nullptr);
  EXPECT_EQ(units->value(), "1");
}

TEST_F(ParameterMaps, MapsWithoutSenseAreRefused) {
  const auto refused = [this](auto&& change) {
    ParameterMap map = sample_map();
    change(map);
    const auto written = write_parameter_map(path_, map);
    return !written.has_value() && written.error().code == ErrorCode::bad_input;
  };
  EXPECT_TRUE(refused([](ParameterMap& m) { m.columns = 0; }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.rows = -1; }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.channels.clear(); }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.channels[0].values.pop_back(); }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.channels[0].name.clear(); }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.channels[1].name = m.channels[0].name; }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.width_m = 0; }));
  EXPECT_TRUE(refused([](ParameterMap& m) { m.height_m = std::nan(""); }));
  // OpenEXR bounds the names.
  EXPECT_TRUE(refused([](ParameterMap& m) { m.attributes[std::string(300, 'k')] = "long"; }));
  EXPECT_TRUE(test::everything_in(folder_.path()).empty());
}

TEST_F(ParameterMaps, AFullDiskKeepsTheOlderMap) {
  ASSERT_TRUE(write_parameter_map(path_, sample_map()).has_value());
  const std::string older = test::bytes_in(path_);
  const int status = test::on_full_disk(1000, [&] {
    const auto written = write_parameter_map(path_, sample_map());
    return !written && written.error().code == ErrorCode::io ? 0 : 1;
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(test::bytes_in(path_), older);
  EXPECT_THAT(test::everything_in(folder_.path()), ElementsAre("map.exr"));
}

TEST_F(ParameterMaps, WhatIsNoParameterMap) {
  EXPECT_EQ(refusal().code, ErrorCode::not_found);
  for (const std::string bytes : {"", "abc", "a text that is longer than four bytes"}) {
    test::put_bytes(path_, bytes);
    EXPECT_EQ(refusal().code, ErrorCode::bad_input);
    EXPECT_THAT(refusal().what, HasSubstr("no OpenEXR file"));
  }
  write_foreign(Imf::Header(4, 4));
  EXPECT_EQ(refusal().code, ErrorCode::bad_input);
  EXPECT_THAT(refusal().what, HasSubstr("no parameter map"));
}

TEST_F(ParameterMaps, ANewerFormatAndMissingAttributes) {
  Imf::Header header(4, 4);
  header.insert("rigd.kind", Imf::StringAttribute("rigd parameter map"));
  header.insert("rigd.format", Imf::IntAttribute(1));
  write_foreign(header);
  EXPECT_EQ(refusal().code, ErrorCode::damaged);
  EXPECT_THAT(refusal().what, HasSubstr("rigd.model"));
  header.insert("rigd.format", Imf::IntAttribute(2));
  write_foreign(header);
  EXPECT_EQ(refusal().code, ErrorCode::newer);
  EXPECT_THAT(refusal().what, HasSubstr("format 2"));
}

// Where the checksum of a compressed block cannot tell, the header's texts differ; the reader must live.
TEST_F(ParameterMaps, DamageIsAnErrorOrHarmless) {
  const ParameterMap map = sample_map();
  ASSERT_TRUE(write_parameter_map(path_, map).has_value());
  const std::string whole = test::bytes_in(path_);
  std::mt19937_64 random(test::seed(3));
  const auto below = [&random](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string bytes = whole;
    if (i % 4 == 0) {
      bytes.resize(below(whole.size()));
    } else {
      bytes[below(whole.size())] ^= static_cast<char>(1U << below(8));
    }
    test::put_bytes(path_, bytes);
    const auto read = read_parameter_map(path_);
    refused += read ? 0 : 1;
    const bool cut = i % 4 == 0;
    EXPECT_FALSE(cut && read) << "cut to " << bytes.size();
    if (read) {
      for (const Channel& c : read->channels) {
        ASSERT_EQ(c.values.size(),
                  static_cast<std::size_t>(read->columns) * static_cast<std::size_t>(read->rows));
      }
    }
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace rig::maps
