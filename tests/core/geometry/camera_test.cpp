// The camera against OpenCV's, and against itself there and back.
#include "core/geometry/camera.h"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "core/base/random.h"
#include "core/base/units.h"
#include "tests/core/seed.h"

namespace rig::geometry {
namespace {

constexpr std::uint64_t kSeed = 20;

// A camera as machine vision has them: 12 to 40 degrees across, distortion up to some tens of pixels.
CameraIntrinsics random_camera(base::Random& random) {
  CameraIntrinsics c;
  c.width = 1600;
  c.height = 1200;
  c.fx = random.uniform(2200, 8000);
  c.fy = c.fx * random.uniform(0.99, 1.01);
  c.cx = random.uniform(760, 840);
  c.cy = random.uniform(560, 640);
  c.k1 = random.uniform(-0.2, 0.2);
  c.k2 = random.uniform(-0.1, 0.1);
  c.k3 = random.uniform(-0.05, 0.05);
  c.p1 = random.uniform(-1e-3, 1e-3);
  c.p2 = random.uniform(-1e-3, 1e-3);
  return c;
}

cv::Matx33d matrix_of(const CameraIntrinsics& c) {
  return {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1};
}

std::vector<double> distortion_of(const CameraIntrinsics& c) {
  return {c.k1, c.k2, c.p1, c.p2, c.k3};
}

Vec2 random_pixel(base::Random& random, const CameraIntrinsics& c) {
  return {random.uniform(-0.5, c.width - 0.5), random.uniform(-0.5, c.height - 0.5)};
}

TEST(Camera, ProjectsAsOpenCvDoes) {
  base::Random random(test::seed(kSeed));
  for (int round = 0; round < 50; ++round) {
    const CameraIntrinsics camera = random_camera(random);
    const Vec3 axis_angle{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const RigidTransform camera_from_world{rotation_from_axis_angle(axis_angle),
                                           {random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), 1.5}};
    std::vector<cv::Point3d> world;
    world.reserve(20);
    for (int i = 0; i < 20; ++i) {
      world.emplace_back(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15),
                         random.uniform(-0.15, 0.15));
    }
    std::vector<cv::Point2d> expected;
    const Vec3 t = camera_from_world.translation;
    cv::projectPoints(world, cv::Vec3d(axis_angle.x, axis_angle.y, axis_angle.z), cv::Vec3d(t.x, t.y, t.z),
                      matrix_of(camera), distortion_of(camera), expected);
    for (std::size_t i = 0; i < world.size(); ++i) {
      const auto pixel = project(camera, camera_from_world.point({world[i].x, world[i].y, world[i].z}));
      ASSERT_TRUE(pixel.has_value());
      EXPECT_NEAR(pixel->x, expected[i].x, 1e-8);
      EXPECT_NEAR(pixel->y, expected[i].y, 1e-8);
    }
  }
}

TEST(Camera, UnprojectsAsOpenCvDoes) {
  base::Random random(test::seed(kSeed + 1));
  for (int round = 0; round < 50; ++round) {
    const CameraIntrinsics camera = random_camera(random);
    std::vector<cv::Point2d> pixels;
    for (int i = 0; i < 20; ++i) {
      const Vec2 p = random_pixel(random, camera);
      pixels.emplace_back(p.x, p.y);
    }
    std::vector<cv::Point2d> expected;
    // OpenCV iterates five times if not told otherwise, which is not enough to compare with.
    cv::undistortPoints(pixels, expected, matrix_of(camera), distortion_of(camera), cv::noArray(),
                        cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12));
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const auto ray = unproject(camera, {pixels[i].x, pixels[i].y});
      ASSERT_TRUE(ray.has_value());
      EXPECT_NEAR(ray->x, expected[i].x, 1e-9);
      EXPECT_NEAR(ray->y, expected[i].y, 1e-9);
      EXPECT_EQ(ray->z, 1);
    }
  }
}

TEST(Camera, UnprojectInvertsProject) {
  base::Random random(test::seed(kSeed + 2));
  for (int round = 0; round < 2000; ++round) {
    const CameraIntrinsics camera = random_camera(random);
    const Vec2 pixel = random_pixel(random, camera);
    const auto ray = unproject(camera, pixel);
    ASSERT_TRUE(ray.has_value());
    const auto again = project(camera, random.uniform(0.1, 10) * *ray);
    ASSERT_TRUE(again.has_value());
    EXPECT_NEAR(again->x, pixel.x, 1e-7);
    EXPECT_NEAR(again->y, pixel.y, 1e-7);
  }
}

// Pixel (0, 0) is the centre of the first pixel. OpenCV's maps of images are indexed by the pixel itself, so
// that entry (v, u) of the undistortion map must be where our camera sees what the ideal one sees at (u, v).
TEST(Camera, PixelsHaveTheirCentresAtWholeNumbers) {
  base::Random random(test::seed(kSeed + 3));
  const CameraIntrinsics camera = random_camera(random);
  CameraIntrinsics ideal = camera;
  ideal.k1 = ideal.k2 = ideal.k3 = ideal.p1 = ideal.p2 = 0;
  cv::Mat map_x;
  cv::Mat map_y;
  cv::initUndistortRectifyMap(matrix_of(camera), distortion_of(camera), cv::noArray(), matrix_of(ideal),
                              cv::Size(camera.width, camera.height), CV_32FC1, map_x, map_y);
  for (const auto& [u, v] : {std::pair(0, 0), {1599, 0}, {0, 1199}, {1599, 1199}, {800, 600}, {17, 1003}}) {
    const auto ray = unproject(ideal, {static_cast<double>(u), static_cast<double>(v)});
    ASSERT_TRUE(ray.has_value());
    const auto pixel = project(camera, *ray);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_NEAR(pixel->x, map_x.at<float>(v, u), 1e-3);
    EXPECT_NEAR(pixel->y, map_y.at<float>(v, u), 1e-3);
  }
}

TEST(Camera, SeesRightToTheRightAndDownDownwards) {
  const CameraIntrinsics camera{100, 80, 50, 50, 49.5, 39.5};
  EXPECT_EQ(project(camera, {0, 0, 2})->x, 49.5) << "the middle of an image of 100 columns";
  EXPECT_EQ(project(camera, {0, 0, 2})->y, 39.5);
  EXPECT_EQ(project(camera, {1, 0, 1})->x, 99.5) << "the right edge of the last column";
  EXPECT_EQ(project(camera, {0, 0.8, 1})->y, 79.5) << "the lower edge of the last row";
}

TEST(Camera, DoesNotSeeBehindItself) {
  const CameraIntrinsics camera{100, 80, 50, 50, 49.5, 39.5};
  EXPECT_FALSE(project(camera, {0, 0, 0}).has_value());
  EXPECT_FALSE(project(camera, {0.1, 0, -1}).has_value());
  EXPECT_FALSE(project(camera, {0, 0, std::nan("")}).has_value());
}

TEST(Camera, SaysWhereTheDistortionFolds) {
  // With k1 = -0.3 the distorted radius r (1 - 0.3 r^2) never exceeds 0.7027 (at r = 1 / sqrt(0.9)).
  CameraIntrinsics camera{1000, 1000, 500, 500, 499.5, 499.5};
  camera.k1 = -0.3;
  EXPECT_TRUE(unproject(camera, {499.5 + 500 * 0.69, 499.5}).has_value());
  EXPECT_FALSE(unproject(camera, {499.5 + 500 * 0.75, 499.5}).has_value());
}

TEST(IntersectPlane, FindsThePointThatWasProjected) {
  base::Random random(test::seed(kSeed + 4));
  int tried = 0;
  while (tried < 2000) {
    const CameraIntrinsics camera = random_camera(random);
    const Vec3 axis_angle{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
    const RigidTransform camera_from_plane{rotation_from_axis_angle(axis_angle),
                                           {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 1.2}};
    const Vec3 point{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0};
    // A plane seen within a degree of its edge has no useful answer.
    const Vec3 normal = camera_from_plane.direction({0, 0, 1});
    const Vec3 view = normalized(camera_from_plane.point(point));
    if (std::abs(dot(normal, view)) < std::sin(base::radians(1))) continue;
    const auto pixel = project(camera, camera_from_plane.point(point));
    ASSERT_TRUE(pixel.has_value());
    if (pixel->x < -0.5 || pixel->y < -0.5 || pixel->x > camera.width || pixel->y > camera.height) continue;
    const auto hit = intersect_plane(camera, camera_from_plane, *pixel);
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->x, point.x, 1e-9);
    EXPECT_NEAR(hit->y, point.y, 1e-9);
    EXPECT_EQ(hit->z, 0);
    ++tried;
  }
}

TEST(IntersectPlane, NothingWhereThePlaneIsBehindOrParallel) {
  const CameraIntrinsics camera{100, 80, 50, 50, 49.5, 39.5};
  EXPECT_FALSE(intersect_plane(camera, {Mat3{}, {0, 0, -1}}, {49.5, 39.5}).has_value());
  EXPECT_FALSE(
      intersect_plane(camera, {{{1, 0, 0, 0, 0, -1, 0, 1, 0}}, {0, 1, 0}}, {49.5, 39.5}).has_value());
}

}  // namespace
}  // namespace rig::geometry
