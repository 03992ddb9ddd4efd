// The screen of `rig watch`: nothing is wider or longer than the terminal, and what matters stays.
#include "clients/rig/watch_view.h"

#include <gtest/gtest.h>
#include <numeric>

#include "core/base/random.h"
#include "tests/core/seed.h"

namespace rig::client {

namespace {

WatchView busy_view() {
  WatchView view;
  view.status.set_rig_name("night rig");
  view.status.set_mode(protocol::RUNNING);
  for (const char* name : {"roll", "tilt", "pan", "arm"}) {
    auto& axis = *view.status.add_axes();
    axis.set_name(name);
    axis.set_min_deg(-90);
    axis.set_max_deg(90);
    axis.set_position_deg(-90);
    axis.set_homed(true);
  }
  view.job.set_job(3);
  view.job.set_name("denim");
  view.job.set_sample("denim, washed");
  view.job.set_state(protocol::ACTIVE);
  view.job.set_poses(200);
  view.job.set_done(50);
  view.pose.set_row(51);
  view.pose.set_attempt(2);
  for (const double angle : {1.0, 2.0, 3.0, 4.0}) view.pose.add_target_deg(angle);
  protocol::FrameTaken frame;
  frame.set_row(50);
  frame.set_exposure_us(160000);
  frame.set_saturated_share(0.125);
  view.bracket.push_back(frame);
  view.seconds_left = 3723;
  view.status.set_free_bytes(120'400'000'000);
  view.status.set_bytes_left(33'100'000'000);
  view.preview.set_preview_width(40);
  view.preview.set_preview_height(30);
  view.preview.set_preview_rgb(std::string(40 * 30 * 3, '\x7f'));
  for (int i = 0; i < 50; ++i) view.messages.push_back("message " + std::to_string(i));
  return view;
}

std::string joined(const std::vector<std::string>& lines) {
  return std::accumulate(lines.begin(), lines.end(), std::string(),
                         [](const std::string& a, const std::string& b) { return a + b + "\n"; });
}

}  // namespace

TEST(WatchView, FitsEveryTerminal) {
  base::Random random(test::seed(5));
  const WatchView view = busy_view();
  for (int i = 0; i < 500; ++i) {
    const TerminalStyle style{1 + static_cast<int>(random.below(250)), 1 + static_cast<int>(random.below(80)),
                              random.uniform() < 0.5, random.uniform() < 0.5};
    const auto lines = draw_watch(view, style);
    EXPECT_LE(lines.size(), static_cast<std::size_t>(style.rows));
    for (const std::string& line : lines) {
      EXPECT_LE(display_width(line), static_cast<std::size_t>(style.columns)) << line;
    }
  }
}

TEST(WatchView, SaysWhatMatters) {
  const std::string text = joined(draw_watch(busy_view(), {80, 40, true, true}));
  for (const char* said : {"night rig: running a job", "job 3 'denim' (denim, washed): active, 50/200 poses",
                           "25 %", "1:02:03 left", "row 51, attempt 2 to 1.0, 2.0, 3.0, 4.0 deg",
                           "row 50 exposed  160 ms (12.50 % sat.)", "roll", "light off", "message 49",
                           "disk 120.4 GB free, the job needs 33.1 GB, full in 3:45:42"}) {
    EXPECT_NE(text.find(said), std::string::npos) << said << "\n" << text;
  }
  EXPECT_EQ(text.find("message 0\n"), std::string::npos) << "the newest messages are shown, not the oldest";
}

TEST(WatchView, ASuspensionStandsWithItsReasonAgeAndLimit) {
  WatchView view = busy_view();
  view.job.set_state(protocol::SUSPENDED);
  view.seconds_left = -1;
  auto& disk = *view.job.add_suspensions();
  disk.set_condition("disk");
  disk.set_reason(
      "the scan's disk has 12.3 MB free; the rest of the job needs 24.3 MB and 500.0 MB of margin");
  disk.set_suspended_s(725);
  disk.set_limit_s(7200);
  auto& held = *view.job.add_suspensions();
  held.set_condition("held");
  held.set_reason("by hand");
  held.set_suspended_s(59);
  for (const int columns : {80, 140}) {  // 140: beside the picture
    const auto lines = draw_watch(view, {columns, 40, true, columns == 80});
    const std::string text = joined(lines);
    EXPECT_NE(text.find("suspended, 50/200 poses"), std::string::npos) << text;
    EXPECT_NE(text.find("suspended by disk for 12:05 of at most 2:00:00: the"), std::string::npos) << text;
    EXPECT_NE(text.find("MB of"), std::string::npos) << "the reason is told to its end\n" << text;
    EXPECT_NE(text.find("margin"), std::string::npos) << text;
    EXPECT_NE(text.find("suspended by held for 0:59: by hand"), std::string::npos) << text;
    EXPECT_NE(text.find("disk 120.4 GB free, the job needs 33.1 GB\n"), std::string::npos)
        << "when it is full is not known without a pace\n"
        << text;
  }
}

TEST(WatchView, AnActiveLimitSwitchIsSeenAtItsEnd) {
  WatchView view = busy_view();
  view.status.mutable_axes(2)->set_at_low_limit(true);
  view.status.mutable_axes(3)->set_at_high_limit(true);
  const std::string text = joined(draw_watch(view, {120, 40, true, false}));
  EXPECT_NE(text.find("tilt     -90.000 deg [|-----------------------] at rest"), std::string::npos) << text;
  EXPECT_NE(text.find("pan      -90.000 deg !|-----------------------] at rest"), std::string::npos) << text;
  EXPECT_NE(text.find("arm      -90.000 deg [|-----------------------! at rest"), std::string::npos) << text;
}

TEST(WatchView, TextIsBrokenBetweenWords) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(wrapped("one two three", 20, "  "), (Lines{"one two three"}));
  EXPECT_EQ(wrapped("one two three", 7, "  "), (Lines{"one two", "  three"}));
  EXPECT_EQ(wrapped("one two three", 8, "  "), (Lines{"one two", "  three"}));
  EXPECT_EQ(wrapped("a longword", 6, "  "), (Lines{"a", "  long", "  word"}));
  EXPECT_EQ(wrapped("", 6, "  "), (Lines{""}));
  EXPECT_EQ(wrapped("words", 1, "  "), (Lines{"w", "  ords"})) << "too narrow for more";
}

TEST(WatchView, TheMostImportantStaysOnASmallTerminal) {
  const auto lines = draw_watch(busy_view(), {80, 4, true, true});
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_NE(joined(lines).find("50/200 poses"), std::string::npos);
}

TEST(WatchView, AStopAndItsReasonAreTheFirstLine) {
  WatchView view = busy_view();
  view.status.set_mode(protocol::STOPPED);
  view.status.set_stop_reason("emergency stop");
  EXPECT_NE(draw_watch(view, {80, 24, true, true}).front().find("stopped: emergency stop"),
            std::string::npos);
}

TEST(WatchView, ThePictureStandsBesideTheTextWhereThereIsRoom) {
  const auto has_picture = [](const TerminalStyle& style) {
    return joined(draw_watch(busy_view(), style)).find("127;127;127") != std::string::npos;
  };
  EXPECT_TRUE(has_picture({140, 40, true, true}));
  EXPECT_FALSE(has_picture({70, 40, true, true})) << "too narrow";
  EXPECT_FALSE(has_picture({140, 40, true, false})) << "no colours";
  EXPECT_FALSE(has_picture({140, 40, false, true})) << "no letters for it";
}

TEST(WatchView, BrokenValuesAreNoTrouble) {
  WatchView view = busy_view();
  view.status.mutable_axes(0)->set_position_deg(std::numeric_limits<double>::quiet_NaN());
  view.status.mutable_axes(1)->set_max_deg(-90);
  view.preview.set_preview_rgb("too short");
  view.job.set_poses(0);
  view.job.set_done(7);
  EXPECT_FALSE(draw_watch(view, {140, 40, true, true}).empty());
  EXPECT_FALSE(draw_watch({}, {80, 24, true, true}).empty());
}

TEST(WatchView, HistogramAndBarAreTheirDefinitions) {
  protocol::Frame frame;
  std::string rgb;
  for (int i = 0; i < 256; ++i) rgb += std::string(3, static_cast<char>(i));
  frame.set_preview_rgb(rgb);
  for (const double share : preview_histogram(frame, 8)) EXPECT_NEAR(share, 1.0 / 8, 1e-12);
  EXPECT_EQ(bar(0.5, 4, false), "##..");
  EXPECT_EQ(bar(2, 3, false), "###");
  EXPECT_EQ(bar(std::numeric_limits<double>::quiet_NaN(), 2, false), "..");
  EXPECT_EQ(display_width(bar(0.3, 10, true)), 10U);
  EXPECT_EQ(display_width("\033[38;2;1;2;3mx\033[0m"), 1U);
}

}  // namespace rig::client
