#include "calibration/registration.h"

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/projection.h"
#include "calibration/registration_file.h"
#include "tests/calibration/synthetic.h"

namespace rig::calibration {
namespace {

using geometry::RigidTransform;
using geometry::Vec2;
using geometry::Vec3;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The tags as an ideal finder would see them, with Gaussian noise.
std::vector<TagSighting> sightings(const machine::RigConfig& rig, const RigidTransform& camera_from_sample,
                                   double sigma_px, std::uint64_t seed) {
  base::Random random(seed);
  std::vector<TagSighting> out;
  for (const machine::Fiducial& fiducial : rig.carrier.fiducials) {
    TagSighting sighting;
    sighting.id = fiducial.id;
    const auto corners = tag_corners(fiducial);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto pixel = geometry::project(rig.camera.intrinsics, camera_from_sample.point(corners[i]));
      sighting.corners[i] = {pixel->x + sigma_px * random.normal(), pixel->y + sigma_px * random.normal()};
      sighting.corner_sigma_px[i] = sigma_px;
    }
    out.push_back(sighting);
  }
  return out;
}

TEST(Projection, DerivativesAreThoseOfProject) {
  const auto camera = testing::small_rig().camera.intrinsics;
  for (const Vec3 p : {Vec3{0.05, -0.03, 1.2}, {-0.2, 0.1, 0.9}, {0, 0, 1}}) {
    const auto made = project_with_derivatives(camera, p);
    ASSERT_TRUE(made);
    constexpr double kStep = 1e-7;
    const std::array<Vec3, 3> steps{Vec3{kStep, 0, 0}, Vec3{0, kStep, 0}, Vec3{0, 0, kStep}};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec2 a = *geometry::project(camera, p + steps[i]), b = *geometry::project(camera, p - steps[i]);
      EXPECT_NEAR(made->by_point[i], (a.x - b.x) / (2 * kStep), 1e-3);
      EXPECT_NEAR(made->by_point[3 + i], (a.y - b.y) / (2 * kStep), 1e-3);
    }
  }
  EXPECT_FALSE(project_with_derivatives(camera, {0, 0, -1}));
}

TEST(SolvePose, FindsThePoseFromAWrongStartAndFromNone) {
  const auto rig = testing::small_rig();
  for (const double tilt : {0.0, 25.0, 60.0, -70.0}) {
    const RigidTransform truth = testing::pose(123, tilt, 12, {0.004, -0.002, 0.01});
    std::vector<Correspondence> points;
    for (const TagSighting& s : sightings(rig, truth, 0, 1)) {
      const auto fiducial = std::find_if(rig.carrier.fiducials.begin(), rig.carrier.fiducials.end(),
                                         [&](const auto& f) { return f.id == s.id; });
      const auto corners = tag_corners(*fiducial);
      for (std::size_t i = 0; i < 4; ++i) points.push_back({s.id, corners[i], s.corners[i], 0.02});
    }
    // A start on the other side of the mirror ambiguity must not matter.
    const auto solved = solve_pose(rig.camera.intrinsics, points, testing::pose(0, -tilt, 0));
    ASSERT_TRUE(solved) << solved.error().text();
    EXPECT_LT(solved->rms_px, 1e-6);
    EXPECT_LT(registration_error_m(rig.camera.intrinsics, solved->camera_from_sample, truth, 0.04, 0.04),
              1e-9);
    EXPECT_TRUE(solved->left_out.empty());
  }
}

// The claim of the covariance, tested by solving again and again: normalised squared errors have mean six,
// and the mean registration error is the expected one.
TEST(SolvePose, CovarianceIsTheSpreadOfResolves) {
  const auto rig = testing::small_rig();
  const RigidTransform truth = testing::pose(30, 40, -10);
  constexpr int kSolves = 400;
  constexpr double kSigma = 0.05;
  double normalised = 0, squares = 0, expected = 0;
  for (int i = 0; i < kSolves; ++i) {
    const auto made = register_tags(
        rig, truth, sightings(rig, truth, kSigma, base::derive_key(5, static_cast<std::uint64_t>(i))));
    ASSERT_TRUE(made.registered) << made.reason;
    const Vec3 r = geometry::axis_angle_from_rotation(made.camera_from_sample.rotation *
                                                      geometry::transposed(truth.rotation));
    const Vec3 t = made.camera_from_sample.translation - truth.translation;
    Eigen::Matrix<double, 6, 1> e;
    e << r.x, r.y, r.z, t.x, t.y, t.z;
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(made.covariance.data());
    normalised += e.dot(covariance.inverse() * e) / kSolves;
    const double error =
        registration_error_m(rig.camera.intrinsics, made.camera_from_sample, truth, 0.04, 0.04);
    squares += error * error / kSolves;
    expected += made.expected_error_m * made.expected_error_m / kSolves;
  }
  // Chi-squared of 6 degrees has variance 12: the mean of 400 scatters by 0.17; the variance factor is
  // estimated from 90 degrees of freedom, which adds 2 %.
  EXPECT_NEAR(normalised, 6, 0.9);
  EXPECT_NEAR(std::sqrt(squares), std::sqrt(expected), 0.1 * std::sqrt(expected));
  std::cout << "normalised " << normalised << ", error " << std::sqrt(squares) * 1e3 << " mm, expected "
            << std::sqrt(expected) * 1e3 << " mm\n";
}

TEST(RegisterTags, LeavesOutWhatContradictsTheRest) {
  const auto rig = testing::small_rig();
  const RigidTransform truth = testing::pose(10, 20, 0);
  auto seen = sightings(rig, truth, 0.02, 3);
  for (auto& corner : seen[2].corners) corner.x += 6;
  TagSighting stranger = seen[0];
  stranger.id = 400;
  seen.push_back(stranger);
  TagSighting twice = seen[5];
  for (auto& corner : twice.corners) corner.y += 50;
  seen.insert(seen.begin() + 6, twice);
  const auto made = register_tags(rig, truth, seen);
  ASSERT_TRUE(made.registered) << made.reason;
  EXPECT_THAT(made.left_out, ElementsAre(seen[2].id, seen[5].id, 400));
  EXPECT_EQ(made.tags.size(), 10U);
  EXPECT_LT(registration_error_m(rig.camera.intrinsics, made.camera_from_sample, truth, 0.04, 0.04), 1e-5);
}

TEST(RegisterTags, RejectsWithAReason) {
  const auto rig = testing::small_rig();
  const RigidTransform truth = testing::pose(10, 20, 0);
  const auto all = sightings(rig, truth, 0.02, 3);

  const auto none = register_tags(rig, truth, {});
  EXPECT_FALSE(none.registered);
  EXPECT_THAT(none.reason, HasSubstr("0 of the carrier's 12 tags"));

  // The first four tags are one row.
  const auto row = register_tags(rig, truth, {all.begin(), all.begin() + 4});
  EXPECT_FALSE(row.registered);
  EXPECT_THAT(row.reason, HasSubstr("in a line"));

  const auto far = register_tags(rig, testing::pose(18, 20, 0), all);
  EXPECT_FALSE(far.registered);
  EXPECT_THAT(far.reason, HasSubstr("from where the motors say"));
  EXPECT_NEAR(base::degrees(far.turn_rad), 8, 0.1);

  auto bent = all;
  base::Random random(4);
  for (auto& tag : bent) {
    for (auto& corner : tag.corners) corner.x += 3 * random.normal();
  }
  const auto rough = register_tags(rig, truth, bent);
  EXPECT_FALSE(rough.registered);
  EXPECT_THAT(rough.reason, HasSubstr("contradict"));
}

// A tag turned on the carrier and configured so is the same as one that is not turned.
TEST(TagCorners, FollowTheTurn) {
  machine::Fiducial tag{1, 0.01, 0.02, 0.012, base::radians(90)};
  const auto corners = tag_corners(tag);
  EXPECT_NEAR(corners[0].x, 0.016, 1e-12);
  EXPECT_NEAR(corners[0].y, 0.014, 1e-12);
  EXPECT_NEAR(corners[1].x, 0.016, 1e-12);
  EXPECT_NEAR(corners[1].y, 0.026, 1e-12);
  const auto wide = tag_corners({1, 0, 0, 0.012, 0}, 0.001);
  EXPECT_NEAR(wide[2].x, 0.007, 1e-12);
  EXPECT_NEAR(wide[2].y, 0.007, 1e-12);
}

struct View {
  double roll_deg, tilt_deg, pan_deg;
};

class RenderedPose : public ::testing::TestWithParam<View> {};

// From pixels to a pose: a tenth of the bound that the rig has to keep.
TEST_P(RenderedPose, IsRegisteredToAFewMicrometres) {
  auto rig = testing::small_rig();
  rig.carrier.fiducials[3].turn_rad = base::radians(90);
  rig.carrier.fiducials[8].turn_rad = base::radians(200);
  const testing::Carrier carrier(rig, [](double x, double) {
    return x > 0 ? testing::Rgb{0.7, 0.2, 0.05} : testing::Rgb{0.05, 0.6, 0.3};
  });
  const View view = GetParam();
  const auto truth = testing::pose(view.roll_deg, view.tilt_deg, view.pan_deg, {0.0013, -0.0007, 0.002});
  const auto signal = testing::render(rig, carrier, truth, {-0.3, 0.5, 0.8}, {20e3, 32e3, 23e3});
  const auto grey = grey_from_mosaic(testing::expose(rig, signal, 0.2, 21), rig.camera.intrinsics.width,
                                     rig.camera.intrinsics.height, rig.camera.bayer, rig.camera.sensor,
                                     rig.camera.white_balance);
  auto finder = TagFinder::create("tag36h11");
  ASSERT_TRUE(finder);
  const auto made = register_tags(rig, testing::pose(view.roll_deg + 0.5, view.tilt_deg - 0.7, view.pan_deg),
                                  finder->find(grey, &rig.camera.intrinsics));
  ASSERT_TRUE(made.registered) << made.reason;
  const double error =
      registration_error_m(rig.camera.intrinsics, made.camera_from_sample, truth, 0.04, 0.04);
  std::cout << made.tags.size() << " tags, rms " << made.rms_px << " px, error " << error * 1e3
            << " mm, expected " << made.expected_error_m * 1e3 << " mm\n";
  EXPECT_LT(error, 0.005e-3);
  // Two degrees of freedom or more share the error: four times the expected is far out.
  EXPECT_LT(error, 4 * made.expected_error_m);
}

INSTANTIATE_TEST_SUITE_P(Views, RenderedPose,
                         ::testing::Values(View{0, 0, 0}, View{160, 40, -20}, View{-50, 60, 0},
                                           View{20, -15, 60}));

RegistrationFile two_poses() {
  const auto rig = testing::small_rig();
  const RigidTransform truth = testing::pose(10, 20, 0);
  RegistrationFile file{"abc123", {}};
  file.poses.push_back(register_tags(rig, testing::pose(10.5, 20, 0), sightings(rig, truth, 0.02, 3)));
  file.poses[0].row = 4;
  file.poses[0].frame = 1;
  PoseRegistration rejected;
  rejected.row = 7;
  rejected.reason = "it said \"no\"\nand a back\\slash";
  rejected.tags = {1, 2};
  file.poses.push_back(rejected);
  return file;
}

TEST(RegistrationFile, ReadsBackToTheLastBit) {
  const RegistrationFile file = two_poses();
  const auto back = parse_registration(format_registration(file), "registration.toml");
  ASSERT_TRUE(back) << back.error().text();
  ASSERT_EQ(back->poses.size(), 2U);
  EXPECT_EQ(back->rig_sha256, "abc123");
  const PoseRegistration& a = file.poses[0];
  const PoseRegistration& b = back->poses[0];
  EXPECT_EQ(b.row, 4);
  EXPECT_EQ(b.frame, 1);
  EXPECT_TRUE(b.registered);
  EXPECT_EQ(a.tags, b.tags);
  EXPECT_EQ(a.camera_from_sample.rotation.m, b.camera_from_sample.rotation.m);
  EXPECT_EQ(a.camera_from_sample.translation.z, b.camera_from_sample.translation.z);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.rms_px, b.rms_px);
  EXPECT_NEAR(a.expected_error_m, b.expected_error_m, 1e-18);
  EXPECT_EQ(back->poses[1].reason, file.poses[1].reason);
  EXPECT_FALSE(back->poses[1].registered);
  EXPECT_EQ(back->poses[1].frame, -1);
}

TEST(RegistrationFile, SaysWhatIsWrongAndWhere) {
  const std::string good = format_registration(two_poses());
  const auto broken = [&good](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
    const auto parsed = parse_registration(text, "registration.toml");
    return parsed ? std::string("accepted") : parsed.error().text();
  };
  EXPECT_THAT(broken("format = 1", "format = 2"), HasSubstr("newer"));
  EXPECT_THAT(broken("status = \"registered\"", "status = \"perhaps\""), HasSubstr("registered"));
  EXPECT_THAT(broken("row = 7", "row = 4"), HasSubstr("twice"));
  EXPECT_THAT(broken("rms_px", "rms_pixels"), HasSubstr("rms_px"));
  EXPECT_THAT(broken("camera_from_sample = [", "camera_from_sample = [3.0, "),
              HasSubstr("registration.toml:"));
  EXPECT_THAT(broken("tags = [", "tags = [0.5, "), HasSubstr("whole number"));
}

TEST(RegistrationFile, MissingSaysHowToMakeIt) {
  const auto read = read_registration("no/such/scan");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().text(), HasSubstr("rig calibrate"));
}

}  // namespace
}  // namespace rig::calibration
