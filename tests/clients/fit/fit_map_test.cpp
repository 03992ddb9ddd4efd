// Whole maps of known materials through the fit, and what never becomes a map.
#include "clients/fit/fit_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/interrupt.h"
#include "core/maps/hdf5_handle.h"
#include "core/maps/parameter_map.h"
#include "tests/clients/known_map.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::fit {
namespace {

using appearance::Lafortune;
using base::ErrorCode;
using maps::Validity;
using test::Observed;
using testing::ElementsAre;
using testing::HasSubstr;

// More rows than a tile has, and neither edge a multiple of it.
constexpr int kColumns = 5;
constexpr int kRows = 19;
constexpr int kPoses = 60;

Lafortune material(int s, int t) {
  return {{0.05 + 0.01 * s, 0.06 + 0.004 * t, 0.08},
          {0.4 + 0.05 * s, 0.5, 0.6 - 0.01 * t},
          -1,
          -1,
          0.8 + 0.01 * t,
          8.0 + 2 * s};
}

Lafortune matt(int s, int t) {
  return {{0.05 + 0.01 * s, 0.1, 0.02 + 0.01 * t}, {}, -1, -1, 1, 10};
}

class FitMap : public testing::Test {
 protected:
  maps::ParameterMap fitted() const {
    const auto done = fit_map(options_);
    EXPECT_TRUE(done.has_value()) << done.error().text();
    auto map = maps::read_parameter_map(options_.out);
    EXPECT_TRUE(map.has_value()) << map.error().text();
    return map.value_or(maps::ParameterMap{});
  }

  // A fit that ends with an Error and leaves the folder as it was.
  base::Error refused() const {
    const auto before = test::everything_in(folder_.path());
    const auto done = fit_map(options_);
    EXPECT_FALSE(done.has_value());
    EXPECT_EQ(test::everything_in(folder_.path()), before);
    return done ? base::Error{} : done.error();
  }

  test::TemporaryFolder folder_;
  maps::ObservationHeader header_ =
      test::header_of(kColumns, kRows, test::spread_poses(kPoses, test::seed(31)));
  Options options_{folder_ / "observation.h5", folder_ / "material.exr", "lafortune", 0};
};

double at(const maps::ParameterMap& map, const std::string& channel, int s, int t) {
  const maps::Channel* found = map.find(channel);
  EXPECT_NE(found, nullptr) << channel;
  return found == nullptr ? test::kUnknown
                          : static_cast<double>(found->values[static_cast<std::size_t>(t * map.columns + s)]);
}

// Every parameter of every texel is that of `material`.
void expect_material(const maps::ParameterMap& map) {
  ASSERT_EQ(map.columns, kColumns);
  ASSERT_EQ(map.rows, kRows);
  for (int t = 0; t < kRows; ++t) {
    for (int s = 0; s < kColumns; ++s) {
      SCOPED_TRACE(testing::Message() << "texel " << s << ", " << t);
      const Lafortune known = material(s, t);
      for (std::size_t c = 0; c < 3; ++c) {
        const std::string colour(1, "RGB"[c]);
        EXPECT_NEAR(at(map, "rho_d." + colour, s, t), known.rho_d[c], 0.002);
        EXPECT_NEAR(at(map, "lobe1.rho_s." + colour, s, t), known.rho_s[c], 0.02 * known.rho_s[c]);
      }
      EXPECT_NEAR(at(map, "lobe1.Cx", s, t), known.cx, 0.01);
      EXPECT_NEAR(at(map, "lobe1.Cy", s, t), known.cy, 0.01);
      EXPECT_NEAR(at(map, "lobe1.Cz", s, t), known.cz, 0.01);
      EXPECT_NEAR(at(map, "lobe1.n", s, t), known.n, 0.02 * known.n);
      EXPECT_LT(at(map, "residual", s, t), 0.002);
    }
  }
}

TEST_F(FitMap, RecoversTheParametersOfEveryTexel) {
  test::write_known_map(options_.observation, header_, material);
  const auto map = fitted();
  expect_material(map);
  EXPECT_EQ(at(map, "count", 0, 0), kPoses);
  EXPECT_EQ(map.model, "lafortune");
  EXPECT_DOUBLE_EQ(map.width_m, header_.width_m);
  EXPECT_DOUBLE_EQ(map.height_m, header_.height_m);
  EXPECT_EQ(map.attributes.at("name"), "known");
  EXPECT_EQ(map.attributes.at("program"), "rig-fit");
  EXPECT_EQ(map.attributes.at("scan"), "/scans/known");
  EXPECT_EQ(map.attributes.at("held_out"), "");
  EXPECT_EQ(map.attributes.at("units.rho_d"), "sr^-1");
}

TEST_F(FitMap, DoesNotSeeThePosesItHoldsOut) {
  // Values that would spoil every texel stand in the poses that are held out.
  test::write_known_map(options_.observation, header_, material, [](Observed& o) {
    if (o.pose % 25 == 24) o.value = {9, 9, 9};
  });
  options_.leave_out = 25;
  const auto map = fitted();
  EXPECT_EQ(map.attributes.at("held_out"), "24 49");
  EXPECT_EQ(at(map, "count", 2, 7), kPoses - 2);
  expect_material(map);
  options_.leave_out = 0;
  EXPECT_GT(at(fitted(), "residual", 2, 7), 0.1) << "the values spoil nothing";
}

TEST_F(FitMap, IgnoresMissingValues) {
  test::write_known_map(options_.observation, header_, material, [](Observed& o) {
    if ((o.pose + o.s) % 5 != 0) return;
    o.value = {50, 0, 50};
    o.validity = Validity::missing;
  });
  const auto map = fitted();
  EXPECT_EQ(at(map, "count", 1, 0), kPoses - kPoses / 5);
  expect_material(map);
}

TEST_F(FitMap, TakesSaturatedValuesAsLowerBoundsOnly) {
  // Half of the poses that see the lobe were exposed too long to tell more than half of its value.
  Validity flag = Validity::saturated;
  const auto clipped = [&flag](Observed& o) {
    if (o.pose % 4 != 0 || o.value[1] < 0.3F) return;
    for (float& v : o.value) v *= 0.5F;
    o.validity = flag;
  };
  test::write_known_map(options_.observation, header_, material, clipped);
  expect_material(fitted());
  flag = Validity::good;
  test::write_known_map(options_.observation, header_, material, clipped);
  EXPECT_GT(at(fitted(), "residual", 2, 7), 0.005) << "the values spoil nothing";
}

TEST_F(FitMap, ATexelNeverSeenIsBlackAndCountsNothing) {
  test::write_known_map(options_.observation, header_, material, [](Observed& o) {
    if (o.s == 3 && o.t == 17) o.validity = Validity::missing;
  });
  const auto map = fitted();
  for (const maps::Channel& channel : map.channels) {
    for (const float value : channel.values) ASSERT_TRUE(std::isfinite(value)) << channel.name;
  }
  EXPECT_EQ(at(map, "count", 3, 17), 0);
  EXPECT_EQ(at(map, "rho_d.R", 3, 17), 0);
  EXPECT_EQ(at(map, "lobe1.rho_s.R", 3, 17), 0);
  EXPECT_EQ(at(map, "residual", 3, 17), 0);
  EXPECT_EQ(at(map, "count", 3, 16), kPoses);
}

TEST_F(FitMap, DiffuseIsTheAlbedoOfEveryTexel) {
  test::write_known_map(options_.observation, header_, matt);
  options_.model = "diffuse";
  const auto map = fitted();
  EXPECT_EQ(map.model, "diffuse");
  for (int t = 0; t < kRows; ++t) {
    for (int s = 0; s < kColumns; ++s) {
      EXPECT_NEAR(at(map, "rho_d.R", s, t), 0.05 + 0.01 * s, 1e-6);
      EXPECT_NEAR(at(map, "rho_d.B", s, t), 0.02 + 0.01 * t, 1e-6);
      EXPECT_EQ(at(map, "lobe1.rho_s.G", s, t), 0);
      EXPECT_NEAR(at(map, "residual", s, t), 0, 1e-6);
    }
  }
}

TEST_F(FitMap, TheResidualIsTheRootMeanSquareOfTheLuminance) {
  // Straight from above with a light so far away that every cosine is 1, and noise that outweighs all else:
  // the fit is the mean of 0.1 and 0.3, everything is 0.1 away from it, and the weights of the luminance add
  // up to 1.
  const std::vector<maps::PoseGeometry> poses(10, test::pose_of(0, {0, 0, 1e4}, {0, 0, 1e4}));
  header_ = test::header_of(2, 1, poses);
  test::write_known_map(options_.observation, header_, matt, [](Observed& o) {
    const float grey = o.pose % 2 == 0 ? 0.1F : 0.3F;
    o.value = {grey, grey, grey};
    // The second texel differs in green alone, whose weight is 0.7152.
    if (o.s == 1) o.value = {0.2F, grey, 0.2F};
    o.variance = 1e6F;
  });
  options_.model = "diffuse";
  const auto map = fitted();
  EXPECT_NEAR(at(map, "rho_d.G", 0, 0), 0.2, 1e-6);
  EXPECT_NEAR(at(map, "residual", 0, 0), 0.1, 1e-6);
  EXPECT_NEAR(at(map, "residual", 1, 0), 0.07152, 1e-6);
}

TEST_F(FitMap, TheSameObservationsAreTheSameBytes) {
  test::write_known_map(options_.observation, header_, material);
  ASSERT_TRUE(fit_map(options_).has_value());
  const std::string first = test::bytes_in(options_.out);
  ASSERT_TRUE(fit_map(options_).has_value());
  EXPECT_FALSE(first.empty());
  EXPECT_TRUE(test::bytes_in(options_.out) == first);
}

TEST_F(FitMap, InterruptedLeavesWhatWasThere) {
  test::write_known_map(options_.observation, header_, material);
  const auto interrupted = [this] {
    base::catch_interrupts();
    if (::raise(SIGTERM) != 0) return 2;
    const auto done = fit_map(options_);
    return !done && done.error().code == ErrorCode::interrupted ? 0 : 1;
  };
  EXPECT_EQ(test::in_child(interrupted), 0);
  EXPECT_EQ(test::everything_in(folder_.path()), std::set<std::string>{"observation.h5"});
  test::put_bytes(options_.out, "the map of yesterday");
  EXPECT_EQ(test::in_child(interrupted), 0);
  EXPECT_EQ(test::bytes_in(options_.out), "the map of yesterday");
}

TEST_F(FitMap, RefusesATruncatedMap) {
  test::write_known_map(options_.observation, header_, material);
  const std::string whole = test::bytes_in(options_.observation);
  for (const double share : {0.999, 0.5, 0.1}) {
    const auto kept = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
    test::put_bytes(options_.observation, whole.substr(0, kept));
    const base::Error error = refused();
    EXPECT_EQ(error.code, ErrorCode::damaged) << share;
    EXPECT_EQ(error.where, options_.observation.string());
  }
}

TEST_F(FitMap, RefusesForeignFiles) {
  EXPECT_EQ(refused().code, ErrorCode::not_found);
  test::put_bytes(options_.observation, "roll,tilt,pan\n1,2,3\n");
  const base::Error text = refused();
  EXPECT_EQ(text.code, ErrorCode::bad_input);
  EXPECT_THAT(text.text(), HasSubstr("observation.h5: is no HDF5 file"));
  {
    const maps::h5::Handle other(
        H5Fcreate(options_.observation.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), &H5Fclose);
    ASSERT_TRUE(other.valid());
  }
  EXPECT_THAT(refused().text(), HasSubstr("no observation map"));
}

TEST_F(FitMap, RefusesANewerMap) {
  test::write_known_map(options_.observation, header_, material);
  {
    const maps::h5::Handle file(H5Fopen(options_.observation.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), &H5Fclose);
    ASSERT_GE(H5Adelete(file.get(), "format"), 0);
    ASSERT_TRUE(maps::h5::write_number(file.get(), "format", 99, maps::h5::Kept::integer).has_value());
  }
  const base::Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::newer);
  EXPECT_THAT(error.what, HasSubstr("99"));
}

TEST_F(FitMap, RefusesRadianceUnderStaticLight) {
  header_.quantity = maps::Quantity::radiance;
  test::write_known_map(options_.observation, header_, material);
  const base::Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::bad_input);
  EXPECT_THAT(error.what, HasSubstr("radiance"));
}

TEST_F(FitMap, RefusesOptionsThatLeadToNoMap) {
  test::write_known_map(options_.observation, header_, material);
  const Options good = options_;
  options_.model = "phong";
  EXPECT_THAT(refused().text(), HasSubstr("'phong' (lafortune or diffuse)"));
  for (const int leave_out : {1, -3}) {
    options_ = good;
    options_.leave_out = leave_out;
    EXPECT_EQ(refused().code, ErrorCode::bad_input) << leave_out;
  }
  options_ = good;
  options_.out = folder_ / "no such folder" / "material.exr";
  EXPECT_EQ(refused().code, ErrorCode::not_found);
  std::filesystem::create_directory(folder_ / "folder");
  options_.out = folder_ / "folder";
  EXPECT_EQ(refused().code, ErrorCode::refused);
}

TEST_F(FitMap, NeverWritesOverItsObservations) {
  test::write_known_map(options_.observation, header_, material);
  const std::string before = test::bytes_in(options_.observation);
  options_.out = folder_.path() / "." / "observation.h5";
  EXPECT_EQ(refused().code, ErrorCode::refused);
  EXPECT_TRUE(test::bytes_in(options_.observation) == before);
}

}  // namespace
}  // namespace rig::fit
