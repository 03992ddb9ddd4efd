// Frames without a copy: the descriptors of a running rigd's memory, and `rig live` that takes its frames
// there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scan/frame_file.h"
#include "core/scan/scan_directory.h"
#include "protocol/frame_reader.h"
#include "tests/system/running_rig.h"

namespace rig::test {
namespace {

using ::testing::HasSubstr;

class LocalFrames : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  RunningRig rig_{folder_ / "rig"};
};

TEST_F(LocalFrames, OfAJobAreThoseOnTheDisk) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  auto reader = protocol::FrameReader::connect(folder_ / "rig/run/frames.sock");
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  rig_.submit(small_job(folder_ / "plan"));
  // A reader that keeps up has every frame of the job.
  std::vector<std::vector<std::uint16_t>> seen;
  std::vector<protocol::LocalFrame> facts;
  std::uint64_t overtaken = 0;
  const auto take = [&](std::chrono::milliseconds patience) {
    auto frame = reader->next(patience);
    ASSERT_TRUE(frame.has_value()) << frame.error().text();
    if (!*frame) return;
    std::vector<std::uint16_t> pixels((*frame)->pixels.begin(), (*frame)->pixels.end());
    overtaken += (*frame)->facts.missed();
    if (!(*frame)->intact()) {
      ++overtaken;
      return;
    }
    facts.push_back((*frame)->facts);
    seen.push_back(std::move(pixels));
  };
  protocol::Request show;
  show.mutable_show_job()->set_job(1);
  protocol::JobState state = protocol::QUEUED;
  while (state == protocol::QUEUED || state == protocol::ACTIVE) {
    for (int i = 0; i < 50; ++i) ASSERT_NO_FATAL_FAILURE(take(std::chrono::milliseconds(10)));
    state = rig_.expect_done(show).job().state();
  }
  ASSERT_EQ(state, protocol::COMPLETE) << rig_.log();
  EXPECT_EQ(rig_.end(SIGTERM), 0);

  const auto journal = scan::Journal::open_read_only(scan::journal_path(rig_.scan()));
  ASSERT_TRUE(journal.has_value());
  const auto poses = journal->poses();
  ASSERT_TRUE(poses.has_value());
  std::size_t stored = 0;
  std::size_t found = 0;
  for (const scan::PoseRecord& pose : *poses) {
    for (const scan::FrameRecord& record : pose.frames) {
      ++stored;
      const auto frame = scan::read_frame(rig_.scan() / record.file);
      ASSERT_TRUE(frame.has_value()) << frame.error().text();
      for (std::size_t i = 0; i < seen.size(); ++i) {
        if (seen[i] != frame->pixels) continue;
        ++found;
        EXPECT_NEAR(facts[i].exposure_us() * 1e-6, record.exposure_s, 1e-9);
        EXPECT_EQ(facts[i].width(), static_cast<std::uint32_t>(frame->width));
        EXPECT_EQ(facts[i].height(), static_cast<std::uint32_t>(frame->height));
        EXPECT_EQ(facts[i].bits(), 12U);
        EXPECT_EQ(facts[i].bayer(), "RGGB");
        break;
      }
    }
  }
  EXPECT_GT(stored, 0U);
  EXPECT_GE(found + overtaken, stored);
  EXPECT_GT(found, stored / 2);
  for (std::size_t i = 1; i < facts.size(); ++i) EXPECT_GT(facts[i].counter(), facts[i - 1].counter());
}

TEST_F(LocalFrames, AreWhatLiveMeasuresOnTheSameMachine) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  // In the dark many frames are tried, and the last one is told of: rigd lets a newcomer in when it has time.
  const auto live = [&](const std::string& endpoint) {
    std::filesystem::remove(folder_ / "live");
    EXPECT_EQ(run_program("rig",
                          {"live", "--once", "--auto", "--exposure-ms", "0.1", "--endpoint", endpoint,
                           "--config", folder_ / "rig/rig.toml", "--save", folder_ / "last.tif"},
                          folder_ / "live"),
              0);
    return bytes_in(folder_ / "live");
  };
  const std::filesystem::path run = folder_ / "rig/run";
  EXPECT_THAT(live("ipc://" + (run / "operate.sock").string()),
              HasSubstr("measured_on raw\nframe_from memory\n"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "last.tif"));
  // The socket alone, as where somebody may not connect to frames.sock.
  std::filesystem::create_directories(folder_ / "elsewhere");
  std::filesystem::create_symlink(run / "operate.sock", folder_ / "elsewhere/operate.sock");
  EXPECT_THAT(live("ipc://" + (folder_ / "elsewhere/operate.sock").string()),
              HasSubstr("measured_on raw\nframe_from socket\n"));
  EXPECT_EQ(rig_.end(SIGTERM), 0);
}

}  // namespace
}  // namespace rig::test
