// The numbers of a report against values worked out by hand.
#include "clients/report/figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/report/page.h"
#include "core/base/units.h"
#include "tests/clients/report/material_map.h"
#include "tests/core/temporary_folder.h"

namespace rig::report {
namespace {

using appearance::Lafortune;
using base::ErrorCode;
using geometry::Vec3;
using maps::Validity;
using test::Observed;
using testing::ElementsAre;
using testing::IsEmpty;

maps::ObservationReader opened(const std::filesystem::path& path) {
  auto reader = maps::ObservationReader::open(path);
  EXPECT_TRUE(reader.has_value()) << reader.error().text();
  return std::move(*reader);
}

// ---- make_view

class MakeView : public testing::Test {
 protected:
  // A light at infinity with cosine 0.8 everywhere, the camera far above; one row of five texels, one for
  // each kind of value. The photograph is grey.
  MakeView() {
    maps::PoseGeometry pose = test::pose_of(7, {0, 0, 1e7}, {});
    pose.light_m = {0.6, 0, 0.8, 0};
    header_ = test::header_of(5, 1, {pose});
    test::write_known_map(
        path_, header_, [](int, int) { return Lafortune{}; },
        [](Observed& o) {
          constexpr std::array<float, 5> kGrey{0.2F, 0.5F, 40, 0.1F, 0};
          constexpr std::array<Validity, 5> kValidity{Validity::good, Validity::good, Validity::missing,
                                                      Validity::saturated, Validity::dark};
          const auto s = static_cast<std::size_t>(o.s);
          o.value = {kGrey[s], kGrey[s], kGrey[s]};
          o.validity = kValidity[s];
        });
  }

  [[nodiscard]] View view(const std::vector<maps::ParameterMap>& maps,
                          const maps::ParameterMap* regions = nullptr) const {
    auto made = make_view(opened(path_), 0, maps, regions);
    EXPECT_TRUE(made.has_value()) << made.error().text();
    return std::move(*made);
  }

  [[nodiscard]] maps::ParameterMap grey(double rho_d) const {
    return test::map_of(header_, [rho_d](int, int) { return Lafortune{{rho_d, rho_d, rho_d}, {}}; });
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "observation.h5";
  maps::ObservationHeader header_;
};

TEST_F(MakeView, CountsDifferencesOverTheTexelsWhoseValueIsRight) {
  const View made = view({grey(0.3)});
  ASSERT_EQ(made.errors.size(), 1U);
  const ViewError& e = made.errors[0];
  // 0.8 times 0.3 - 0.2, 0.3 - 0.5 and 0.3 - 0: the good ones and the dark one.
  EXPECT_EQ(e.texels, 3U);
  EXPECT_NEAR(e.mean, (0.08 - 0.16 + 0.24) / 3, 1e-7);
  EXPECT_NEAR(e.mean_absolute, 0.16, 1e-7);
  EXPECT_NEAR(e.deviation, 0.1643843, 1e-6);
  EXPECT_THAT(made.rough_error, IsEmpty());
}

TEST_F(MakeView, WeighsChannelsAsLuminance) {
  // Right in green and blue, 0.5 too much in red.
  const auto reddish = [](int s, int) {
    const double grey = s == 0 ? 0.2 : s == 1 ? 0.5 : 0.0;
    return Lafortune{{grey + 0.5, grey, grey}, {}};
  };
  const View made = view({grey(0.3), test::map_of(header_, reddish)});
  ASSERT_EQ(made.errors.size(), 2U);
  EXPECT_NEAR(made.errors[1].mean, 0.8 * 0.2126 * 0.5, 1e-7);
  EXPECT_NEAR(made.errors[1].mean_absolute, 0.8 * 0.2126 * 0.5, 1e-7);
  EXPECT_NEAR(made.errors[1].deviation, 0, 1e-4);
}

TEST_F(MakeView, RoughRegionsBeginAtTheirLimit) {
  maps::ParameterMap regions = test::regions_of(header_, 0);
  regions.channels[1].values = {0.1F, 0.079F, 0.5F, 0.5F, 0.08F};
  const View made = view({grey(0.3)}, &regions);
  EXPECT_THAT(made.rough_error, ElementsAre(testing::DoubleNear((0.08 + 0.24) / 2, 1e-7)));
}

TEST_F(MakeView, RendersTheLobeAndKeepsThePhotograph) {
  const View made = view({test::map_of(header_, [](int s, int) {
    return Lafortune{{0.1, 0.2, 0.3}, {0.5, 0.25, s == 4 ? 1.0 : 0.0}, -1, -1, 1, 2};
  })});
  EXPECT_EQ(made.pose, 0);
  EXPECT_NEAR(made.incident_deg, base::degrees(std::acos(0.8)), 1e-9);
  EXPECT_NEAR(made.exitant_deg, 0, 1e-9);
  ASSERT_EQ(made.photograph.rgb.size(), 15U);
  EXPECT_NEAR(made.photograph.rgb[3], 0.8 * 0.5, 1e-6);
  ASSERT_EQ(made.renderings.size(), 1U);
  const auto& rgb = made.renderings[0].rgb;
  ASSERT_EQ(rgb.size(), 15U);
  // (0.8)^2 of the lobe, all times the cosine.
  EXPECT_NEAR(rgb[0], 0.8 * (0.1 + 0.5 * 0.64), 1e-6);
  EXPECT_NEAR(rgb[1], 0.8 * (0.2 + 0.25 * 0.64), 1e-6);
  EXPECT_NEAR(rgb[2], 0.8 * 0.3, 1e-6);
  EXPECT_NEAR(rgb[14], 0.8 * (0.3 + 0.64), 1e-6);
}

TEST_F(MakeView, OfAPoseThatIsNotThereIsAnError) {
  const auto reader = opened(path_);
  for (const int pose : {-1, 1}) {
    const auto made = make_view(reader, pose, {grey(0.3)}, nullptr);
    ASSERT_FALSE(made.has_value()) << pose;
    EXPECT_EQ(made.error().code, ErrorCode::bad_input);
  }
}

TEST_F(MakeView, LightBelowTheHorizonCountsNothing) {
  header_.poses[0].light_m = {0.6, 0, -0.8, 0};
  test::write_known_map(path_, header_, [](int, int) { return Lafortune{}; });
  const View made = view({grey(0.3)});
  EXPECT_EQ(made.errors[0].texels, 0U);
  EXPECT_EQ(made.errors[0].mean_absolute, 0);
  EXPECT_EQ(made.errors[0].deviation, 0);
}

// ---- compare_with_truth

constexpr double kHeight_m = 1;

// Seen from straight above: the camera's x is the sample's, y and z are reversed. Registered as if the sample
// lay `shift_m` beside where it is, what truly is at x is taken for x + shift_m.
std::array<double, 12> from_above(double shift_m) {
  return {1, 0, 0, -shift_m, 0, -1, 0, 0, 0, 0, -1, kHeight_m};
}

Vec3 from_the_side(double theta_deg) {
  return {std::sin(base::radians(theta_deg)), 0, std::cos(base::radians(theta_deg))};
}

class CompareWithTruth : public testing::Test {
 protected:
  CompareWithTruth() {
    const Vec3 above{0, 0, kHeight_m};
    truth_header_ = test::header_of(2, 2, {});
    // Moderate; light too steep for the reflectance; camera too steep for both.
    truth_header_.poses = {test::pose_of(0, above, from_the_side(30)),
                           test::pose_of(4, above, from_the_side(61)),
                           test::pose_of(8, from_the_side(61), from_the_side(30))};
    truth_header_.provenance = {{"every", "2"}};
    header_ = truth_header_;
    header_.columns = 4;
    header_.rows = 3;
    constexpr std::array<double, 3> kShift_mm{0.04, 0.08, 5};
    for (std::size_t p = 0; p < 3; ++p) {
      truth_header_.poses[p].camera_from_sample = from_above(0);
      header_.poses[p].camera_from_sample = from_above(base::metres_from_mm(kShift_mm[p]));
    }
  }

  // What truly is there differs from texel to texel, pose to pose and channel to channel.
  static float truly(int s, int t, int pose, std::size_t c) {
    return 0.1F + 0.01F * static_cast<float>(s + 4 * t + 16 * pose) + 0.002F * static_cast<float>(c);
  }

  void write_truth() const {
    test::write_known_map(
        truth_, truth_header_, [](int, int) { return Lafortune{}; },
        [](Observed& o) {
          for (std::size_t c = 0; c < 3; ++c) o.value[c] = truly(o.s, o.t, o.pose, c);
        });
  }

  // `factor` times the truth where the truth is known; nonsense between.
  void write_measured(
      float factor, const test::Change& change = [](Observed&) {}) const {
    test::write_known_map(
        measured_, header_, [](int, int) { return Lafortune{}; },
        [&](Observed& o) {
          const bool known = o.s % 2 == 0 && o.t % 2 == 0;
          for (std::size_t c = 0; c < 3; ++c)
            o.value[c] = known ? factor * truly(o.s / 2, o.t / 2, o.pose, c) : 7;
          change(o);
        });
  }

  [[nodiscard]] TruthFigures figures() const {
    const auto compared = compare_with_truth(opened(measured_), truth_);
    EXPECT_TRUE(compared.has_value()) << compared.error().text();
    return compared.value_or(TruthFigures{});
  }

  void expect_refused(const char* why) const {
    write_truth();
    const auto compared = compare_with_truth(opened(measured_), truth_);
    ASSERT_FALSE(compared.has_value()) << why;
    EXPECT_EQ(compared.error().code, ErrorCode::bad_input) << why;
    EXPECT_EQ(compared.error().where, truth_.string()) << why;
  }

  test::TemporaryFolder folder_;
  std::filesystem::path measured_ = folder_ / "observation.h5", truth_ = folder_ / "truth.h5";
  maps::ObservationHeader header_, truth_header_;
};

TEST_F(CompareWithTruth, FindsTheShiftAndTheFactor) {
  write_truth();
  write_measured(1.1F);
  const TruthFigures found = figures();
  EXPECT_EQ(found.registered_poses, 2U);
  EXPECT_NEAR(found.registration_rms_mm, std::sqrt((0.04 * 0.04 + 0.08 * 0.08) / 2), 1e-9);
  EXPECT_EQ(found.values, 2U * 2U * 3U);
  EXPECT_NEAR(found.reflectance_error, 0.1, 1e-6);
}

TEST_F(CompareWithTruth, OfTheTruthItselfIsZero) {
  header_.poses = truth_header_.poses;
  write_truth();
  write_measured(1);
  EXPECT_NEAR(figures().registration_rms_mm, 0, 1e-9);
  EXPECT_NEAR(figures().reflectance_error, 0, 1e-7);
}

TEST_F(CompareWithTruth, CountsGoodValuesOnly) {
  write_truth();
  write_measured(0.8F, [](Observed& o) {
    if (o.s != 0) return;
    o.value = {90, 90, 90};
    o.validity = o.t == 0 ? Validity::saturated : Validity::missing;
  });
  EXPECT_EQ(figures().values, 2U * 3U);
  EXPECT_NEAR(figures().reflectance_error, 0.2, 1e-6);
}

TEST_F(CompareWithTruth, WhatNothingEnteredIsNotKnownAndNotMet) {
  for (auto* header : {&header_, &truth_header_}) {
    for (auto& pose : header->poses) pose.camera_m = {0.98, 0, 0.17};
  }
  write_truth();
  write_measured(1);
  const TruthFigures found = figures();
  EXPECT_EQ(found.registered_poses, 0U);
  EXPECT_EQ(found.values, 0U);
  EXPECT_TRUE(std::isnan(found.registration_rms_mm));
  EXPECT_TRUE(std::isnan(found.reflectance_error));
  EXPECT_FALSE((Figure{"registration", found.registration_rms_mm, 0.05}).met());
  EXPECT_FALSE((Figure{"improvement", found.reflectance_error, 1.5, true}).met());
}

TEST_F(CompareWithTruth, OfPosesThatWereNotRegisteredIsNotKnown) {
  header_.poses[1].camera_from_sample.fill(test::kUnknown);
  write_truth();
  write_measured(1.1F);
  EXPECT_TRUE(std::isnan(figures().registration_rms_mm));
  EXPECT_NEAR(figures().reflectance_error, 0.1, 1e-6);
}

TEST_F(CompareWithTruth, RefusesTheTruthOfAnotherMap) {
  write_measured(1);
  const maps::ObservationHeader right = truth_header_;
  for (const char* every : {"", "0", "-2", "1", "2x", "2147483647", "99999999999999999999"}) {
    truth_header_.provenance["every"] = every;
    expect_refused(every);
  }
  truth_header_.provenance.clear();
  expect_refused("no step");
  truth_header_ = right;
  truth_header_.poses.pop_back();
  expect_refused("fewer poses");
  truth_header_ = right;
  truth_header_.poses[1].row = 5;
  expect_refused("another pose");
  truth_header_ = right;
  truth_header_.rows = 1;
  expect_refused("fewer rows");
  truth_header_ = right;
  truth_header_.width_m *= 1.01;
  expect_refused("another size");
  truth_header_ = right;
  write_truth();
  EXPECT_TRUE(compare_with_truth(opened(measured_), truth_).has_value());
}

TEST_F(CompareWithTruth, WithoutTheFileIsAnError) {
  write_measured(1);
  const auto compared = compare_with_truth(opened(measured_), truth_);
  ASSERT_FALSE(compared.has_value());
  EXPECT_EQ(compared.error().code, ErrorCode::not_found);
}

// ---- held_out_poses and model_at

std::vector<int> held_out(const std::string& text) {
  maps::ParameterMap map;
  map.attributes["held_out"] = text;
  return held_out_poses(map);
}

TEST(HeldOut, IsTheListInTheOrderOfTheFile) {
  EXPECT_THAT(held_out_poses({}), IsEmpty());
  EXPECT_THAT(held_out(""), IsEmpty());
  EXPECT_THAT(held_out("9 19 29"), ElementsAre(9, 19, 29));
  EXPECT_THAT(held_out(" \t19\n0  "), ElementsAre(19, 0));
}

TEST(HeldOut, PassesOverWhatIsNoPose) {
  EXPECT_THAT(held_out("3,17"), IsEmpty());
  EXPECT_THAT(held_out("3 x 17"), ElementsAre(3, 17));
  EXPECT_THAT(held_out("-1 4"), ElementsAre(4));
  EXPECT_THAT(held_out("1.5 2e3 0x10 +6 8"), ElementsAre(8));
  EXPECT_THAT(held_out("99999999999999999999 7"), ElementsAre(7));
  EXPECT_THAT(held_out("4 4 2 4"), ElementsAre(4, 2));
}

TEST(ModelAt, ReadsOneTexelAndTakesMissingChannelsAsZero) {
  const auto header = test::header_of(3, 2, {});
  auto map = test::map_of(header, [](int s, int t) {
    return Lafortune{{0.1 * s, 0.1 * t, 0.5}, {1, 2, 3}, -0.9, -0.8, 0.7, 10.0 + s};
  });
  const Lafortune model = model_at(map, 5);
  EXPECT_NEAR(model.rho_d[0], 0.2, 1e-6);
  EXPECT_NEAR(model.rho_d[1], 0.1, 1e-6);
  EXPECT_NEAR(model.rho_s[2], 3, 1e-6);
  EXPECT_NEAR(model.cx, -0.9, 1e-6);
  EXPECT_NEAR(model.cy, -0.8, 1e-6);
  EXPECT_NEAR(model.cz, 0.7, 1e-6);
  EXPECT_NEAR(model.n, 12, 1e-6);
  map.channels.resize(1);
  EXPECT_EQ(model_at(map, 5).rho_s[2], 0);
}

}  // namespace
}  // namespace rig::report
