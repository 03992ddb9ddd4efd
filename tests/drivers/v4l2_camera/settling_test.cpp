// When the brightness of frames has arrived at what was set.
#include "drivers/v4l2_camera/settling.h"

#include <gtest/gtest.h>
#include <vector>

namespace rig::drivers::v4l2 {
namespace {

constexpr double kLeast = 2.5;

std::optional<int> settled(double before, const std::vector<double>& levels) {
  return settled_at(before, levels, kLeast);
}

TEST(Settling, TheFirstFrameOfTheNewLevelIsFound) {
  EXPECT_EQ(settled(10, {90, 90, 90, 90, 90, 90}), 0);
  EXPECT_EQ(settled(10, {10, 10, 90, 90, 90, 90, 90}), 2);
  EXPECT_EQ(settled(90, {90, 90, 90, 90, 10, 10, 10}), 4) << "downwards, too";
}

TEST(Settling, OnTheWayIsNotThere) {
  EXPECT_EQ(settled(10, {10, 50, 70, 90, 90, 90, 90}), 3);
  EXPECT_EQ(settled(10, {10, 85, 90, 90, 90, 90, 90}), 1) << "within a tenth of the change";
  EXPECT_EQ(settled(10, {10, 90, 10, 90, 90, 90, 90}), 3) << "what comes and goes has not settled";
}

TEST(Settling, NoiseIsNotAChange) {
  EXPECT_EQ(settled(10, {10, 10, 90, 91, 89, 90, 91, 90}), 2);
  EXPECT_EQ(settled(10, {10, 12, 9, 11, 12, 8, 13, 9}), std::nullopt);
  EXPECT_EQ(settled(10, {10, 40, 30, 60, 30, 25, 45, 30}), std::nullopt) << "it drowns";
}

TEST(Settling, WhatCannotBeSeenIsNotGuessed) {
  EXPECT_EQ(settled(0, {0, 0, 0, 0, 0, 0, 0}), std::nullopt) << "darkness";
  EXPECT_EQ(settled(255, {255, 255, 255, 255, 255, 255}), std::nullopt) << "saturation";
  EXPECT_EQ(settled(10, {10, 10, 12, 12, 12, 12, 12}), std::nullopt) << "too little";
  EXPECT_EQ(settled(10, {10, 10, 10, 10, 10, 10, 90}), std::nullopt) << "not at its end";
  EXPECT_EQ(settled(10, {90, 90, 90}), std::nullopt) << "too few";
}

}  // namespace
}  // namespace rig::drivers::v4l2
