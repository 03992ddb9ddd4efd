// The screen and the lines of `rig live`.
#include "clients/rig/live_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numeric>

#include "core/base/random.h"
#include "tests/core/seed.h"

namespace rig::client {
namespace {

using testing::HasSubstr;
using testing::Not;

LiveView some_view() {
  LiveView view;
  view.frame.exposure_us = 20000;
  view.frame.region = {400, 300, 1200, 900};
  view.frame.focus = 12.345;
  view.frame.exposed = {0.00125, 0.25, 0.68};
  view.frame.fiducials = {0, 1, 2, 3, 5, 7, 8};
  view.expected = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  view.best_focus = 24.69;
  for (int i = 0; i <= 40; ++i) view.focus_history.push_back(0.6 * i);
  view.automatic = true;
  view.rig = "night rig";
  view.light = "light on, level 1.00";
  view.picture.set_preview_width(40);
  view.picture.set_preview_height(30);
  view.picture.set_preview_rgb(std::string(40 * 30 * 3, '\x7f'));
  return view;
}

std::string joined(const std::vector<std::string>& lines) {
  return std::accumulate(lines.begin(), lines.end(), std::string(),
                         [](const std::string& a, const std::string& b) { return a + b + "\n"; });
}

TEST(LiveView, FitsEveryTerminal) {
  base::Random random(test::seed(62));
  LiveView view = some_view();
  view.note = std::string(300, 'x');
  for (int i = 0; i < 500; ++i) {
    const TerminalStyle style{1 + static_cast<int>(random.below(250)), 1 + static_cast<int>(random.below(80)),
                              random.uniform() < 0.5, random.uniform() < 0.5};
    const auto lines = draw_live(view, style);
    EXPECT_LE(lines.size(), static_cast<std::size_t>(style.rows));
    for (const std::string& line : lines)
      EXPECT_LE(display_width(line), static_cast<std::size_t>(style.columns)) << line;
  }
}

TEST(LiveView, SaysWhatIsTurnedFor) {
  const std::string text = joined(draw_live(some_view(), {80, 24, true, false}));
  for (const char* said :
       {"12.35, best so far 24.69", "50 % of best", "20 ms, automatic", "68 % of full scale", "too bright",
        "saturated  0.125 %   at black 25.000 %", "7 of 9: 0-3, 5, 7, 8", "missing    4, 6",
        "800 x 600 pixels at 400, 300 (raw)", "night rig", "light on"})
    EXPECT_THAT(text, HasSubstr(said));
}

TEST(LiveView, ThePictureIsBesideOrBelowOrNotThere) {
  const LiveView view = some_view();
  const std::string cell = "\033[38;2;127;127;127m";
  const auto wide = draw_live(view, {120, 24, true, true});
  EXPECT_THAT(wide.front(), testing::AllOf(HasSubstr("best so far"), HasSubstr(cell)));
  const auto narrow = draw_live(view, {60, 40, true, true});
  EXPECT_THAT(narrow.front(), Not(HasSubstr(cell)));
  EXPECT_THAT(narrow.back(), HasSubstr(cell));
  EXPECT_THAT(joined(draw_live(view, {60, 16, true, true})), Not(HasSubstr(cell)));
  EXPECT_THAT(joined(draw_live(view, {120, 24, true, false})), Not(HasSubstr("\033")));
  LiveView blind = view;
  blind.picture = {};
  EXPECT_THAT(joined(draw_live(blind, {120, 24, true, true})), Not(HasSubstr("\033")));
}

TEST(LiveView, OfNothingIsNoNonsense) {
  const std::string text = joined(draw_live({}, {80, 24, true, true}));
  EXPECT_THAT(text, HasSubstr("0 % of best"));
  EXPECT_THAT(text, HasSubstr("too dark"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(LiveView, ALineHoldsAFrame) {
  EXPECT_EQ(live_line(some_view()),
            "exposure 20 ms, focus 12.35 (50 % of best), level 68 %, saturated 0.125 %, at black 25.000 %, 7 "
            "fiducials: 0-3, 5, 7, 8");
}

TEST(LiveView, FiguresAreNamesAndValues) {
  EXPECT_EQ(
      live_figures(some_view().frame),
      "exposure_ms 20\nfocus 12.345\nlevel_percent 68\nsaturated_percent 0.125\nblack_percent "
      "25\nfiducials 7\nfiducial_ids 0 1 2 3 5 7 8\nregion_px 400 300 800 600\nmeasured_on raw\nframe_from "
      "socket\n");
}

TEST(LiveView, RangesOfIds) {
  EXPECT_EQ(id_ranges({}), "");
  EXPECT_EQ(id_ranges({4}), "4");
  EXPECT_EQ(id_ranges({4, 5}), "4, 5");
  EXPECT_EQ(id_ranges({0, 1, 2, 5, 7, 8, 10, 11, 12}), "0-2, 5, 7, 8, 10-12");
  // A reflection of a tag beside the tag.
  EXPECT_EQ(id_ranges({3, 3, 4}), "3, 3, 4");
}

}  // namespace
}  // namespace rig::client
