// A scan on disk of the shipped rig, with frames of a few pixels, in any state a crash may leave it in.
#pragma once

#include <filesystem>
#include <gtest/gtest.h>
#include <string>

#include "core/base/hash.h"
#include "core/scan/scan_directory.h"
#include "tests/core/machine/rig_file.h"
#include "tests/core/scan/some_frame.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan::testing {

namespace fs = std::filesystem;

inline constexpr int kPoses = 4;
inline constexpr int kFrames = 3;
inline constexpr int kWidth = 9;
inline constexpr int kHeight = 6;

inline std::string job_text() {
  machine::JobConfig job;
  job.name = "small";
  job.sample = "none";
  job.poses = some_plan(kPoses);
  job.exposure.exposures_s = {0.16, 0.08, 0.04};
  return machine::format_job_config(job, "for a test");
}

/// A scan in a folder that goes with it. The steps of a capture can be made one by one, and every take of a
/// row has other pixels.
class SmallScan {
 public:
  SmallScan() {
    const auto made = create_scan(path(), machine::shipped_rig_text(), job_text());
    EXPECT_TRUE(made.has_value()) << made.error().text();
  }
  [[nodiscard]] fs::path path() const { return folder_ / "scan"; }
  [[nodiscard]] fs::path frame(std::int64_t row, int index) const {
    return frames_folder(path(), row) / frame_name(index);
  }

  [[nodiscard]] static std::vector<std::uint16_t> pixels(std::int64_t row, int index, int take) {
    return some_pixels(kWidth, kHeight, static_cast<std::uint64_t>(row * 1000 + index * 10 + take));
  }

  /// Stores one frame of a take and hands back its hash.
  std::string store(std::int64_t row, int index, int take = 1) const {
    const auto hash =
        store_frame(path(), some_facts(row, index), kWidth, kHeight, pixels(row, index, take).data());
    EXPECT_TRUE(hash.has_value()) << hash.error().text();
    return hash.value_or("");
  }

  /// Stores the whole bracket; the record to commit.
  PoseRecord store_all(std::int64_t row, int take = 1) const {
    PoseRecord pose = some_pose(row, 0);
    pose.attempt = take;
    for (int index = 0; index < kFrames; ++index) {
      FrameRecord frame;
      frame.index = index;
      frame.file = fs::relative(this->frame(row, index), path()).string();
      frame.exposure_s = some_facts(row, index).exposure_s;
      frame.sha256 = store(row, index, take);
      pose.frames.push_back(frame);
    }
    return pose;
  }

  void publish(std::int64_t row) const {
    const auto done = publish_bracket(path(), row);
    EXPECT_TRUE(done.has_value()) << done.error().text();
  }

  void commit(const PoseRecord& pose) const {
    auto journal = Journal::open(journal_path(path()));
    ASSERT_TRUE(journal.has_value()) << journal.error().text();
    const auto done = journal->commit_pose(pose, {});
    EXPECT_TRUE(done.has_value()) << done.error().text();
  }

  void take(std::int64_t row, int take = 1) const {
    const PoseRecord pose = store_all(row, take);
    publish(row);
    commit(pose);
  }

  void take_all() const {
    for (std::int64_t row = 0; row < kPoses; ++row) take(row);
  }

  /// What the next start does after a crash.
  void tidy() const {
    const auto journal = Journal::open(journal_path(path()));
    ASSERT_TRUE(journal.has_value()) << journal.error().text();
    const auto done = tidy_scan(path(), *journal);
    EXPECT_TRUE(done.has_value()) << done.error().text();
  }

  /// All below frames/, relative to it.
  [[nodiscard]] std::set<std::string> frames() const { return test::everything_in(path() / "frames"); }

 private:
  const test::TemporaryFolder folder_;
};

}  // namespace rig::scan::testing
