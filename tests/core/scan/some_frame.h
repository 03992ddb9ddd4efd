// Frames and records of scans for tests: small, and different in every field.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/base/units.h"
#include "core/scan/frame_file.h"
#include "core/scan/journal.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan::testing {

inline machine::JointAngles angles_deg(double roll, double tilt, double pan, double arm) {
  return {base::radians(roll), base::radians(tilt), base::radians(pan), base::radians(arm)};
}

inline FrameFacts some_facts(std::int64_t row, int index) {
  FrameFacts facts;
  facts.row = row;
  facts.index = index;
  facts.target_rad = angles_deg(-23.1, 19.0, -11.25, 46.5);
  facts.readback_rad = angles_deg(-23.11, 19.02, -11.245, 46.4999);
  facts.exposure_s = 0.16 / (index + 1);
  facts.gain = 1.5;
  facts.bayer = "RGGB";
  facts.bits = 12;
  return facts;
}

inline std::vector<std::uint16_t> some_pixels(int width, int height, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (auto& pixel : pixels) pixel = static_cast<std::uint16_t>(random());
  return pixels;
}

inline std::string as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A new file instead of the old: some file systems flush one that is cut to nothing and written again, which
/// takes long where it is done a thousand times.
inline void put_anew(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);
  test::put_bytes(path, bytes);
}

/// The bytes of a good frame of 7 x 5 pixels.
inline std::string some_frame_bytes() {
  const auto pixels = some_pixels(7, 5, 3);
  return as_text(encode_frame(some_facts(12, 1), 7, 5, pixels.data()).value());
}

/// `text` with its only `from` replaced by `to`, of the same length: no offset of the file moves.
inline std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_EQ(from.size(), to.size());
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

inline std::vector<machine::JointAngles> some_plan(int rows) {
  std::vector<machine::JointAngles> plan;
  for (int row = 0; row < rows; ++row) plan.push_back(angles_deg(1.0 * row, -row, 0.5 * row, 60 + row));
  return plan;
}

inline base::Time at_us(std::int64_t us) {
  return base::Time(std::chrono::microseconds(us));
}

inline PoseRecord some_pose(std::int64_t row, int frames) {
  PoseRecord pose;
  pose.row = row;
  pose.attempt = 2;
  pose.target_rad = some_plan(static_cast<int>(row) + 1).back();
  pose.readback_rad = angles_deg(0.25 + static_cast<double>(row), -1.5, 2.5, 61);
  pose.arrived = at_us(1'000'000 + row);
  pose.committed = at_us(2'000'000 + row);
  for (int index = 0; index < frames; ++index) {
    pose.frames.push_back({index, "frames/" + std::to_string(row) + "/" + std::to_string(index),
                           0.1 / (index + 1), 1.25, 0.01 * index, at_us(1'500'000 + index),
                           std::string(64, static_cast<char>('a' + index))});
  }
  return pose;
}

inline EventRecord some_event(std::uint64_t epoch, std::uint64_t number) {
  return {epoch, number, at_us(static_cast<std::int64_t>(number)), "event " + std::to_string(number)};
}

}  // namespace rig::scan::testing
