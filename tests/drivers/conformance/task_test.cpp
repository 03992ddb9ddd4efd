// Tasks as arguments of a program.
#include "drivers/conformance/task.h"

#include <gtest/gtest.h>

namespace rig::drivers::conformance {
namespace {

void expect_the_same_again(const Task& task) {
  const auto words = words_of(task);
  const auto again = task_of(words);
  ASSERT_TRUE(again.has_value()) << again.error().text();
  EXPECT_EQ(again->device, task.device);
  EXPECT_EQ(again->what.index(), task.what.index());
  EXPECT_EQ(words_of(*again), words);
}

TEST(Task, IsTheSameAfterItsWords) {
  expect_the_same_again({"pan", MoveTask{-0.1, 1.0 / 3, 2, 1e-9}});
  expect_the_same_again({"camera", ExposeTask{0.128, 1}});
  expect_the_same_again({"light", ShineTask{0.4}});
  expect_the_same_again({"lines", SetLineTask{"relay", true}});
  expect_the_same_again({"lines", SetLineTask{"", false}});
}

TEST(Task, NumbersComeBackExactly) {
  const auto again = task_of(words_of({"pan", MoveTask{1.0 / 3, -2.0 / 7, 1e-300, 5}}));
  ASSERT_TRUE(again.has_value());
  const auto& move = std::get<MoveTask>(again->what);
  EXPECT_EQ(move.from_rad, 1.0 / 3);
  EXPECT_EQ(move.to_rad, -2.0 / 7);
  EXPECT_EQ(move.velocity_rad_s, 1e-300);
  EXPECT_EQ(move.acceleration_rad_s2, 5);
}

TEST(Task, WordsThatAreNoneAreRefused) {
  const std::vector<std::vector<std::string>> wrong{{},
                                                    {"pan"},
                                                    {"pan", "move"},
                                                    {"pan", "move", "1", "2", "3"},
                                                    {"pan", "move", "1", "2", "3", "x"},
                                                    {"pan", "shine", ""},
                                                    {"pan", "fly", "1"},
                                                    {"lines", "set_line", "relay"}};
  for (const auto& words : wrong) {
    const auto task = task_of(words);
    ASSERT_FALSE(task.has_value()) << words.size();
    EXPECT_EQ(task.error().code, base::ErrorCode::bad_input);
  }
}

}  // namespace
}  // namespace rig::drivers::conformance
