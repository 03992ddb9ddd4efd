// Observation maps: what was written is what is read, whole or not at all.
#include "core/maps/observation_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include "core/maps/observation_layout.h"
#include "tests/core/maps/observation_samples.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::maps {
namespace {

using base::ErrorCode;
using testing::ElementsAre;
using testing::HasSubstr;

// Both edges of the map cut tiles.
constexpr int kColumns = 37;
constexpr int kRows = 21;
constexpr int kPoses = 5;

class ObservationMap : public testing::Test {
 protected:
  void write() { ASSERT_TRUE(write_map(path_, header_).has_value()); }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "observation.h5";
  ObservationHeader header_ = sample_header(kColumns, kRows, kPoses);
};

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

TEST_F(ObservationMap, TheHeaderComesBack) {
  // Longer than the 64 KiB that HDF5 keeps of an attribute beside its object.
  header_.provenance["job"] = std::string(200'000, 'j');
  header_.quantity = Quantity::radiance;
  header_.absolute = false;
  write();
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  const ObservationHeader& h = reader->header();
  EXPECT_EQ(h.columns, kColumns);
  EXPECT_EQ(h.rows, kRows);
  EXPECT_EQ(h.width_m, header_.width_m);
  EXPECT_EQ(h.height_m, header_.height_m);
  EXPECT_EQ(h.quantity, Quantity::radiance);
  EXPECT_FALSE(h.absolute);
  EXPECT_EQ(h.name, header_.name);
  EXPECT_EQ(h.provenance, header_.provenance);
  ASSERT_EQ(h.poses.size(), header_.poses.size());
  for (std::size_t p = 0; p < h.poses.size(); ++p) {
    const PoseGeometry& a = h.poses[p];
    const PoseGeometry& b = header_.poses[p];
    EXPECT_EQ(a.row, b.row);
    EXPECT_EQ(a.camera_m, b.camera_m);
    EXPECT_EQ(a.light_m, b.light_m);
    EXPECT_TRUE(std::equal(a.target_rad.begin(), a.target_rad.end(), b.target_rad.begin(), same));
    EXPECT_EQ(a.camera_from_sample, b.camera_from_sample);
    EXPECT_EQ(a.registration_rms_px, b.registration_rms_px);
  }
}

TEST_F(ObservationMap, AnyRectangleReadsAsWritten) {
  write();
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  std::mt19937_64 random(test::seed(1));
  const auto upto = [&random](int n) { return std::uniform_int_distribution<int>(0, n)(random); };
  for (int i = 0; i < 300; ++i) {
    const int first_row = upto(kRows - 1);
    const int first_column = upto(kColumns - 1);
    const int rows = 1 + upto(kRows - first_row - 1);
    const int columns = 1 + upto(kColumns - first_column - 1);
    const auto block = reader->read(first_row, rows, first_column, columns);
    ASSERT_TRUE(block.has_value()) << block.error().text();
    ASSERT_TRUE(same_texels(*block, sample_block(header_, first_row, rows, first_column, columns)))
        << first_row << " " << rows << " " << first_column << " " << columns;
  }
}

TEST_F(ObservationMap, AnyOrderOfAnyBlocksWritesTheSameValues) {
  auto writer = ObservationWriter::create(path_, header_);
  ASSERT_TRUE(writer.has_value());
  // Rectangles that cut tiles, from the last to the first.
  for (int t = kRows - 1; t >= 0; t -= 5) {
    const int first = std::max(0, t - 4);
    ASSERT_TRUE(writer->write(sample_block(header_, first, t - first + 1, 20, kColumns - 20)).has_value());
    ASSERT_TRUE(writer->write(sample_block(header_, first, t - first + 1, 0, 20)).has_value());
  }
  ASSERT_TRUE(writer->finish().has_value());
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value());
  const auto all = reader->read(0, kRows, 0, kColumns);
  ASSERT_TRUE(all.has_value());
  EXPECT_TRUE(same_texels(*all, whole_map(header_)));
}

TEST_F(ObservationMap, OnePoseIsThatPoseOfEveryTexel) {
  write();
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value());
  const ObservationBlock all = whole_map(header_);
  for (int p = 0; p < kPoses; ++p) {
    const auto pose = reader->read_pose(p);
    ASSERT_TRUE(pose.has_value()) << pose.error().text();
    ASSERT_EQ(pose->poses, 1);
    ASSERT_EQ(pose->rows, kRows);
    ASSERT_EQ(pose->columns, kColumns);
    for (int t = 0; t < kRows; ++t) {
      for (int s = 0; s < kColumns; ++s) {
        const std::size_t one = pose->texel_index(t, s);
        const std::size_t of_all = all.texel_index(t, s) + static_cast<std::size_t>(p);
        ASSERT_EQ(pose->validity[one], all.validity[of_all]);
        for (std::size_t c = 0; c < 3; ++c) {
          ASSERT_EQ(pose->value[3 * one + c], all.value[3 * of_all + c]);
          ASSERT_EQ(pose->variance[3 * one + c], all.variance[3 * of_all + c]);
        }
      }
    }
  }
}

TEST_F(ObservationMap, WhatWasNeverWrittenIsMissing) {
  auto writer = ObservationWriter::create(path_, header_);
  ASSERT_TRUE(writer.has_value());
  // In the middle of a tile, so that some of the missing texels share a chunk with written ones.
  ASSERT_TRUE(writer->write(sample_block(header_, 3, 2, 3, 2)).has_value());
  ASSERT_TRUE(writer->finish().has_value());
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value());
  auto all = reader->read(0, kRows, 0, kColumns);
  ASSERT_TRUE(all.has_value());
  const ObservationBlock written = sample_block(header_, 3, 2, 3, 2);
  for (int t = 0; t < kRows; ++t) {
    for (int s = 0; s < kColumns; ++s) {
      const bool inside = t >= 3 && t < 5 && s >= 3 && s < 5;
      for (std::size_t p = 0; p < kPoses; ++p) {
        const std::size_t i = all->texel_index(t, s) + p;
        const std::size_t j = inside ? written.texel_index(t - 3, s - 3) + p : 0;
        ASSERT_EQ(all->validity[i], inside ? written.validity[j] : Validity::missing);
        ASSERT_EQ(all->value[3 * i], inside ? written.value[3 * j] : 0.0F);
        ASSERT_EQ(all->variance[3 * i], inside ? written.variance[3 * j] : 0.0F);
      }
    }
  }
}

TEST_F(ObservationMap, TheSameMapIsTheSameBytes) {
  write();
  const std::string first = test::bytes_in(path_);
  ASSERT_TRUE(write_map(folder_ / "again.h5", header_).has_value());
  EXPECT_EQ(first, test::bytes_in(folder_ / "again.h5"));
  // Equal also in another second: nothing in it has a time.
  const h5::Handle file(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose);
  for (const char* name : {"value", "variance", "validity", "/pose", "/pose/row", "/pose/camera_m", "/"}) {
    H5O_info_t info;
    ASSERT_GE(H5Oget_info_by_name(file.get(), name, &info, H5P_DEFAULT), 0) << name;
    EXPECT_EQ(info.mtime, 0) << name;
    EXPECT_EQ(info.ctime, 0) << name;
  }
}

TEST_F(ObservationMap, TilesAreContiguousWithAllTheirPoses) {
  write();
  const h5::Handle file(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose);
  const h5::Handle value(H5Dopen2(file.get(), "value", H5P_DEFAULT), &H5Dclose);
  const h5::Handle plan(H5Dget_create_plist(value.get()), &H5Pclose);
  std::array<hsize_t, 4> chunk{};
  ASSERT_EQ(H5Pget_chunk(plan.get(), 4, chunk.data()), 4);
  EXPECT_THAT(chunk, ElementsAre(kTile, kTile, kPoses, 3));
}

TEST(ObservationLayout, TilesShrinkOnlyWhereHdf5WouldRefuseThem) {
  constexpr std::uint64_t kLimit = std::uint64_t{1} << 32;
  EXPECT_EQ(tile_edge(1), kTile);
  const std::uint64_t most = (kLimit - 1) / tile_bytes(kTile, 1);
  EXPECT_EQ(tile_edge(most), kTile);
  EXPECT_EQ(tile_edge(most + 1), kTile / 2);
  for (std::uint64_t poses = 1; poses < kLimit / 16; poses *= 3) {
    EXPECT_LT(tile_bytes(tile_edge(poses), poses), kLimit) << poses;
  }
}

TEST_F(ObservationMap, UntilItIsFinishedNothingHasItsName) {
  test::put_bytes(path_, "an older map");
  {
    auto writer = ObservationWriter::create(path_, header_);
    ASSERT_TRUE(writer.has_value());
    ASSERT_TRUE(writer->write(whole_map(header_)).has_value());
    EXPECT_EQ(test::bytes_in(path_), "an older map");
    EXPECT_THAT(test::everything_in(folder_.path()), ElementsAre("observation.h5", "observation.h5.part"));
  }
  EXPECT_EQ(test::bytes_in(path_), "an older map");
  EXPECT_THAT(test::everything_in(folder_.path()), ElementsAre("observation.h5"));
  // A part that a killed program left is no obstacle.
  test::put_bytes(folder_ / "observation.h5.part", "half a map");
  write();
  EXPECT_THAT(test::everything_in(folder_.path()), ElementsAre("observation.h5"));
  EXPECT_TRUE(ObservationReader::open(path_).has_value());
}

TEST_F(ObservationMap, AFullDiskIsAnErrorAndLeavesNothing) {
  // Tiles of several hundred kilobytes on a disk with room for the header only: it shows at the latest when
  // the caches are flushed.
  header_ = sample_header(64, 64, 40);
  const std::size_t whole = [&] {
    EXPECT_TRUE(write_map(path_, header_).has_value());
    return std::filesystem::file_size(path_);
  }();
  std::filesystem::remove(path_);
  for (const std::size_t room : {std::size_t{0}, std::size_t{4000}, whole / 2, whole - 1}) {
    const int status = test::on_full_disk(room, [&] {
      const auto written = write_map(path_, header_);
      if (written) return 1;
      return written.error().code == ErrorCode::io && !written.error().where.empty() ? 0 : 2;
    });
    EXPECT_EQ(status, 0) << room << " of " << whole << " bytes";
    EXPECT_TRUE(test::everything_in(folder_.path()).empty()) << room;
  }
}

TEST_F(ObservationMap, AFolderInTheWayStays) {
  std::filesystem::create_directories(path_ / "kept");
  const auto made = ObservationWriter::create(path_, header_);
  ASSERT_FALSE(made.has_value());
  EXPECT_EQ(made.error().code, ErrorCode::refused);
  EXPECT_TRUE(std::filesystem::exists(path_ / "kept"));
}

TEST_F(ObservationMap, BlocksThatDoNotFitAreRefused) {
  auto writer = ObservationWriter::create(path_, header_);
  ASSERT_TRUE(writer.has_value());
  const ObservationBlock good = sample_block(header_, 0, kTile, 0, kTile);
  const auto refused = [&writer](ObservationBlock block) {
    const auto written = writer->write(block);
    return !written.has_value() && written.error().code == ErrorCode::bad_input;
  };
  ObservationBlock block = good;
  block.first_row = kRows - kTile + 1;
  EXPECT_TRUE(refused(block));
  block = good;
  block.first_column = -1;
  EXPECT_TRUE(refused(block));
  block = good;
  block.first_row = std::numeric_limits<int>::max();
  EXPECT_TRUE(refused(block));
  block = good;
  block.poses = kPoses - 1;
  EXPECT_TRUE(refused(block));
  block = good;
  block.variance.pop_back();
  EXPECT_TRUE(refused(block));
  block = good;
  block.rows = 0;
  EXPECT_TRUE(refused(block));
  EXPECT_TRUE(writer->write(good).has_value());
}

TEST_F(ObservationMap, HeadersWithoutSenseAreRefused) {
  const auto refused = [this](auto&& change) {
    ObservationHeader header = header_;
    change(header);
    const auto made = ObservationWriter::create(path_, header);
    return !made.has_value() && made.error().code == ErrorCode::bad_input;
  };
  EXPECT_TRUE(refused([](ObservationHeader& h) { h.columns = 0; }));
  EXPECT_TRUE(refused([](ObservationHeader& h) { h.rows = -3; }));
  EXPECT_TRUE(refused([](ObservationHeader& h) { h.poses.clear(); }));
  EXPECT_TRUE(refused([](ObservationHeader& h) { h.width_m = 0; }));
  EXPECT_TRUE(refused([](ObservationHeader& h) { h.height_m = std::nan(""); }));
  EXPECT_TRUE(test::everything_in(folder_.path()).empty());
}

TEST_F(ObservationMap, RectanglesAndPosesOutsideAreRefused) {
  write();
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value());
  EXPECT_FALSE(reader->read(-1, 2, 0, 2).has_value());
  EXPECT_FALSE(reader->read(0, kRows + 1, 0, 2).has_value());
  EXPECT_FALSE(reader->read(0, 0, 0, 2).has_value());
  EXPECT_FALSE(reader->read(0, 1, kColumns - 1, 2).has_value());
  EXPECT_FALSE(reader->read(1, std::numeric_limits<int>::max(), 0, 2).has_value());
  EXPECT_FALSE(reader->read_pose(-1).has_value());
  EXPECT_FALSE(reader->read_pose(kPoses).has_value());
}

}  // namespace
}  // namespace rig::maps
