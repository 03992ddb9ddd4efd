// Files that only look like observation maps: each is refused with its reason, none hurts the reader.
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <numeric>

#include "core/maps/hdf5_handle.h"
#include "tests/core/maps/observation_samples.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::maps {
namespace {

using base::Error;
using base::ErrorCode;
using h5::Handle;
using testing::HasSubstr;

class DamagedObservationMap : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(write_map(path_, header_).has_value()); }

  // The file opened for changes by the library itself.
  void change(const std::function<void(hid_t)>& body) {
    const Handle file(H5Fopen(path_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), &H5Fclose);
    ASSERT_TRUE(file.valid());
    body(file.get());
  }

  [[nodiscard]] Error refusal() const {
    const auto reader = ObservationReader::open(path_);
    EXPECT_FALSE(reader.has_value());
    if (reader) return {};
    EXPECT_EQ(reader.error().where, path_.string());
    return reader.error();
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "observation.h5";
  ObservationHeader header_ = sample_header(37, 21, 5);
};

TEST_F(DamagedObservationMap, NoSuchFile) {
  std::filesystem::remove(path_);
  EXPECT_EQ(refusal().code, ErrorCode::not_found);
}

TEST_F(DamagedObservationMap, NoHdf5File) {
  for (const std::string bytes : {"", "# a text\n", "\x89HDF"}) {
    test::put_bytes(path_, bytes);
    const Error error = refusal();
    EXPECT_EQ(error.code, ErrorCode::bad_input);
    EXPECT_THAT(error.what, HasSubstr("no HDF5 file"));
  }
}

TEST_F(DamagedObservationMap, AnotherHdf5File) {
  { const Handle other(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), &H5Fclose); }
  const Error error = refusal();
  EXPECT_EQ(error.code, ErrorCode::bad_input);
  EXPECT_THAT(error.what, HasSubstr("no observation map"));
}

TEST_F(DamagedObservationMap, ANewerVersion) {
  change([](hid_t file) {
    ASSERT_GE(H5Adelete(file, "format"), 0);
    ASSERT_TRUE(h5::write_number(file, "format", 2, h5::Kept::integer).has_value());
  });
  const Error error = refusal();
  EXPECT_EQ(error.code, ErrorCode::newer);
  EXPECT_THAT(error.what, HasSubstr("format 2"));
}

TEST_F(DamagedObservationMap, EveryDatasetAndAttributeIsNeeded) {
  const std::string whole = test::bytes_in(path_);
  for (const std::string name : {"value", "variance", "validity", "pose/row", "pose/camera_m", "pose/light_m",
                                 "pose/target_rad", "pose/camera_from_sample", "pose/registration_rms_px"}) {
    change([&](hid_t file) { ASSERT_GE(H5Ldelete(file, name.c_str(), H5P_DEFAULT), 0) << name; });
    const Error error = refusal();
    EXPECT_EQ(error.code, ErrorCode::damaged) << name;
    EXPECT_THAT(error.what, HasSubstr(name));
    test::put_bytes(path_, whole);
  }
  for (const std::string name : {"format", "width_m", "height_m", "quantity", "absolute", "name"}) {
    change([&](hid_t file) { ASSERT_GE(H5Adelete(file, name.c_str()), 0) << name; });
    EXPECT_THAT(refusal().what, HasSubstr(name));
    test::put_bytes(path_, whole);
  }
}

TEST_F(DamagedObservationMap, AWrongShape) {
  const std::string whole = test::bytes_in(path_);
  const auto replace = [this](const char* name, const std::vector<hsize_t>& shape) {
    change([&](hid_t file) {
      H5Ldelete(file, name, H5P_DEFAULT);
      const std::vector<double> zeros(1000, 0.0);
      ASSERT_TRUE(h5::write_table(file, name, shape, zeros, "1", h5::Kept::real).has_value());
    });
  };
  const std::vector<std::pair<const char*, std::vector<hsize_t>>> wrong{
      {"value", {2, 3}},          {"value", {2, 3, 5, 4}},   {"variance", {21, 37, 4, 3}},
      {"validity", {21, 36, 5}},  {"/pose/row", {4}},        {"/pose/row", {5, 1}},
      {"/pose/camera_m", {5, 4}}, {"/pose/light_m", {6, 4}}, {"/pose/camera_m", {3}}};
  for (const auto& [name, shape] : wrong) {
    // write_table takes as many of the zeros as the shape needs.
    if (std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>()) > 1000) {
      change([&](hid_t file) {
        H5Ldelete(file, name, H5P_DEFAULT);
        const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr),
                           &H5Sclose);
        const Handle made(
            H5Dcreate2(file, name, H5T_IEEE_F32LE, space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
            &H5Dclose);
        ASSERT_TRUE(made.valid());
      });
    } else {
      replace(name, shape);
    }
    const Error error = refusal();
    EXPECT_EQ(error.code, ErrorCode::damaged) << name;
    EXPECT_THAT(error.what, HasSubstr("shape")) << name;
    test::put_bytes(path_, whole);
  }
}

TEST_F(DamagedObservationMap, AMillionPosesThatAreNotThereTakeNoMemory) {
  // A dataset may claim any extent without storing a byte of it.
  change([](hid_t file) {
    for (const auto& [name, channels] : {std::pair{"value", 3}, {"variance", 3}, {"validity", 0}}) {
      H5Ldelete(file, name, H5P_DEFAULT);
      std::vector<hsize_t> shape{21, 37, 2'000'000'000};
      std::vector<hsize_t> chunk{1, 1, 1000};
      if (channels > 0) {
        shape.push_back(3);
        chunk.push_back(3);
      }
      const int dimensions = static_cast<int>(shape.size());
      const Handle space(H5Screate_simple(dimensions, shape.data(), nullptr), &H5Sclose);
      const Handle plan(H5Pcreate(H5P_DATASET_CREATE), &H5Pclose);
      H5Pset_chunk(plan.get(), dimensions, chunk.data());
      const Handle made(
          H5Dcreate2(file, name, H5T_IEEE_F32LE, space.get(), H5P_DEFAULT, plan.get(), H5P_DEFAULT),
          &H5Dclose);
      ASSERT_TRUE(made.valid());
    }
  });
  EXPECT_THAT(refusal().what, HasSubstr("pose/row"));
}

TEST_F(DamagedObservationMap, AttributesOfOtherTypes) {
  const std::string whole = test::bytes_in(path_);
  // Two numbers where one belongs.
  change([](hid_t file) {
    H5Adelete(file, "width_m");
    const hsize_t two = 2;
    const std::array<double, 2> values{1, 2};
    const Handle space(H5Screate_simple(1, &two, nullptr), &H5Sclose);
    const Handle attribute(H5Acreate2(file, "width_m", H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                           &H5Aclose);
    ASSERT_GE(H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, values.data()), 0);
  });
  EXPECT_THAT(refusal().what, HasSubstr("width_m"));
  test::put_bytes(path_, whole);
  // A text where a number belongs, and the other way round.
  change([](hid_t file) {
    H5Adelete(file, "height_m");
    ASSERT_TRUE(h5::write_text(file, "height_m", "0.16").has_value());
  });
  EXPECT_THAT(refusal().what, HasSubstr("height_m"));
  test::put_bytes(path_, whole);
  change([](hid_t file) {
    H5Adelete(file, "quantity");
    ASSERT_TRUE(h5::write_number(file, "quantity", 1, h5::Kept::real).has_value());
  });
  EXPECT_THAT(refusal().what, HasSubstr("quantity"));
  test::put_bytes(path_, whole);
  change([](hid_t file) {
    H5Adelete(file, "quantity");
    ASSERT_TRUE(h5::write_text(file, "quantity", "weight").has_value());
  });
  EXPECT_THAT(refusal().what, HasSubstr("'weight'"));
}

TEST_F(DamagedObservationMap, TextsOfFixedLengthAreReadToo) {
  change([](hid_t file) {
    H5Adelete(file, "quantity");
    const Handle type(H5Tcopy(H5T_C_S1), &H5Tclose);
    H5Tset_size(type.get(), 12);
    const Handle space(H5Screate(H5S_SCALAR), &H5Sclose);
    const Handle attribute(H5Acreate2(file, "quantity", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                           &H5Aclose);
    ASSERT_GE(H5Awrite(attribute.get(), type.get(), "radiance\0\0\0\0"), 0);
  });
  const auto reader = ObservationReader::open(path_);
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  EXPECT_EQ(reader->header().quantity, Quantity::radiance);
}

TEST_F(DamagedObservationMap, CutShortAnywhere) {
  const std::string whole = test::bytes_in(path_);
  std::mt19937_64 random(test::seed(2));
  std::vector<std::size_t> lengths{1, 7, 8, 16, 64, 96, 512, 2048, whole.size() - 1};
  for (int i = 0; i < 60; ++i) {
    lengths.push_back(std::uniform_int_distribution<std::size_t>(0, whole.size() - 1)(random));
  }
  for (const std::size_t length : lengths) {
    test::put_bytes(path_, whole.substr(0, length));
    const Error error = refusal();
    EXPECT_TRUE(error.code == ErrorCode::damaged || error.code == ErrorCode::bad_input) << length;
    EXPECT_FALSE(error.what.empty());
  }
}

}  // namespace
}  // namespace rig::maps
