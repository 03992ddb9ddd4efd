// Whole pages: what stands on them, what must not, and when none is written.
#include "clients/report/page.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/interrupt.h"
#include "tests/clients/report/material_map.h"
#include "tests/clients/report/png.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::report {
namespace {

using appearance::Lafortune;
using base::ErrorCode;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

constexpr int kColumns = 6;
constexpr int kRows = 4;

Lafortune material(int s, int t) {
  return {{0.05 + 0.01 * s, 0.06 + 0.02 * t, 0.08}, {0.4, 0.5, 0.6}, -1, -1, 0.9, 12};
}
Lafortune flat(int, int) {
  return {{0.1, 0.1, 0.1}, {}, -1, -1, 1, 10};
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++n;
  return n;
}

// Every value of an attribute like src="...".
std::vector<std::string> values_of(const std::string& html, const std::string& attribute) {
  const std::string start = " " + attribute + "=\"";
  std::vector<std::string> values;
  for (auto at = html.find(start); at != std::string::npos; at = html.find(start, at)) {
    at += start.size();
    values.push_back(html.substr(at, html.find('"', at) - at));
  }
  return values;
}

class Page : public testing::Test {
 protected:
  Page() {
    options_.observation = folder_ / "observation.h5";
    options_.maps = {folder_ / "material.exr"};
    options_.out = folder_ / "report.html";
  }

  void write_observation() const { test::write_known_map(options_.observation, header_, material); }
  void write_map(std::size_t index = 0) const {
    const auto done = maps::write_parameter_map(options_.maps[index], index == 0 ? map_ : other_);
    ASSERT_TRUE(done.has_value()) << done.error().text();
  }
  void write_all() const {
    write_observation();
    for (std::size_t i = 0; i < options_.maps.size(); ++i) write_map(i);
  }

  // A truth that says the observations are right, with rough regions everywhere.
  void write_truth() {
    options_.truth = folder_ / "truth.h5";
    maps::ObservationHeader truth = header_;
    truth.provenance = {{"every", "1"}};
    test::write_known_map(options_.truth, truth, material);
    write_regions(test::regions_of(header_, 0.3F));
  }
  void write_regions(const maps::ParameterMap& regions) const {
    ASSERT_TRUE(maps::write_parameter_map(folder_ / "truth.regions.exr", regions).has_value());
  }

  [[nodiscard]] std::vector<Figure> reported() const {
    const auto figures = write_report(options_);
    EXPECT_TRUE(figures.has_value()) << figures.error().text();
    return figures.value_or(std::vector<Figure>{});
  }
  [[nodiscard]] std::string page() const { return test::bytes_in(options_.out); }

  // A report that ends with an Error and leaves the folder as it was.
  [[nodiscard]] base::Error refused() const {
    const auto before = test::everything_in(folder_.path());
    const auto figures = write_report(options_);
    EXPECT_FALSE(figures.has_value());
    EXPECT_EQ(test::everything_in(folder_.path()), before);
    return figures ? base::Error{} : figures.error();
  }

  test::TemporaryFolder folder_;
  maps::ObservationHeader header_ = test::header_of(kColumns, kRows, test::spread_poses(12, test::seed(41)));
  maps::ParameterMap map_ = test::map_of(header_, material);
  maps::ParameterMap other_ = test::map_of(header_, flat, "diffuse");
  Options options_;
};

TEST_F(Page, OfPhotographsWithoutMotorsFiducialsOrTruth) {
  map_.attributes["held_out"] = "3 7";
  write_all();
  EXPECT_TRUE(reported().empty()) << "nothing can be judged without a truth";
  const std::string html = page();
  EXPECT_THAT(html, HasSubstr("12 poses, 2 of them held out"));
  EXPECT_THAT(html, HasSubstr("6 x 4 texels over 120.0 x 80.0 mm"));
  EXPECT_THAT(html, HasSubstr("BRDF in sr^-1"));
  EXPECT_THAT(html, HasSubstr("<td>pose 9 ("));
  EXPECT_THAT(html, HasSubstr("<td>pose 21 ("));
  EXPECT_EQ(count_of(html, "<td>pose "), 2U);
  EXPECT_THAT(html, Not(HasSubstr("virtual rig")));
  for (const char* number : {">nan", " nan", "-nan", "\"nan", "+nan"})
    EXPECT_THAT(html, Not(HasSubstr(number)));
}

TEST_F(Page, ARenderingOfTheSameMaterialDiffersNowhere) {
  write_all();
  (void)reported();
  const std::string html = page();
  EXPECT_EQ(count_of(html, "<td>pose "), header_.poses.size()) << "without held-out poses all are shown";
  EXPECT_EQ(count_of(html, "<td>0.00000</td><td>0.00000</td></tr>"), header_.poses.size());
}

TEST_F(Page, ShowsAsManyViewsAsAskedFor) {
  options_.maps.push_back(folder_ / "diffuse.exr");
  write_all();
  // Two colours and the lobe's four numbers; a view is the photograph and two pictures a map.
  for (const int views : {0, 2, 12, 1000}) {
    options_.views = views;
    (void)reported();
    EXPECT_EQ(count_of(page(), "<img "), 6U + 5U * static_cast<std::size_t>(std::min(views, 12))) << views;
  }
}

TEST_F(Page, IsSelfContained) {
  write_all();
  (void)reported();
  const std::string html = page();
  for (const char* outside : {"http:", "https:", "href", "<link", "<script", "<iframe", "@import", "url("})
    EXPECT_THAT(html, Not(HasSubstr(outside)));
  const auto sources = values_of(html, "src");
  ASSERT_FALSE(sources.empty());
  EXPECT_THAT(sources, Each(testing::StartsWith("data:image/png;base64,")));
  for (const std::string& source : sources) {
    const test::Png png = test::decoded(source);
    EXPECT_EQ(png.width, kColumns);
    EXPECT_EQ(png.height, kRows);
  }
}

TEST_F(Page, ShowsTheSampleUpright) {
  // The edge of greatest y is bright.
  map_ = test::map_of(header_, [](int, int t) { return Lafortune{{t == kRows - 1 ? 1.0 : 0.0, 0, 0}, {}}; });
  write_all();
  (void)reported();
  const test::Png first = test::decoded(values_of(page(), "src").front());
  EXPECT_GT(first.at(2, 0)[0], 200);
  EXPECT_EQ(first.at(2, kRows - 1)[0], 0);
}

TEST_F(Page, NamesAreTextAndNeverMarkup) {
  const std::string evil = "\"><script>alert('&')</script><b x=\"";
  header_.name = evil;
  header_.provenance = {{evil, evil}};
  map_.model = evil;
  map_.add(evil);
  map_.attributes["held_out"] = evil;
  other_.model = evil + "2";
  options_.maps.push_back(folder_ / "diffuse.exr");
  write_all();
  write_truth();
  auto regions = test::regions_of(header_, 0.3F);
  regions.attributes["region.0"] = evil;
  write_regions(regions);
  const auto figures = reported();
  EXPECT_TRUE(std::any_of(figures.begin(), figures.end(),
                          [&](const Figure& f) { return f.name.find(evil) != std::string::npos; }));
  const std::string html = page();
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("<b x")));
  const std::string harmless = "&quot;&gt;&lt;script&gt;alert('&amp;')&lt;/script&gt;&lt;b x=&quot;";
  for (const auto& [before, after] : {std::pair("<title>", "</title>"), std::pair("<h1>", "</h1>"),
                                      std::pair("<tr><td>", "</td><td>"), std::pair("<th>", " mean</th>"),
                                      std::pair("alt=\"rendering, ", "\""), std::pair(", ", ": measured")}) {
    EXPECT_THAT(html, HasSubstr(before + harmless + after));
  }
}

TEST_F(Page, JudgesAgainstTheTruth) {
  for (auto& pose : header_.poses) pose.camera_from_sample = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 1};
  options_.maps.push_back(folder_ / "diffuse.exr");
  map_ = test::map_of(header_, [](int s, int t) {
    auto m = material(s, t);
    m.rho_d[1] += 0.001;
    return m;
  });
  write_all();
  write_truth();
  const auto figures = reported();
  ASSERT_EQ(figures.size(), 3U);
  EXPECT_EQ(figures[0].name, "registration_rms_mm");
  EXPECT_NEAR(figures[0].value, 0, 1e-9);
  EXPECT_EQ(figures[1].name, "reflectance_median_relative_error");
  EXPECT_NEAR(figures[1].value, 0, 1e-9);
  EXPECT_EQ(figures[2].name, "rough_regions_improvement_over_diffuse");
  EXPECT_GT(figures[2].value, 10);
  for (const Figure& f : figures) EXPECT_TRUE(f.met()) << f.name;
  EXPECT_EQ(count_of(page(), "class=\"ok\""), 3U);
}

TEST_F(Page, AFigureOfUnregisteredPosesIsMissed) {
  write_all();
  write_truth();
  const auto figures = reported();
  ASSERT_EQ(figures.size(), 2U);
  EXPECT_FALSE(figures[0].met());
  EXPECT_TRUE(figures[1].met());
  EXPECT_EQ(count_of(page(), "class=\"missed\""), 1U);
}

TEST_F(Page, OnlyPosesThatExistAreHeldOut) {
  map_.attributes["held_out"] = "1 99 x 2147483647";
  write_all();
  (void)reported();
  EXPECT_THAT(page(), HasSubstr("1 of them held out"));
  EXPECT_EQ(count_of(page(), "<td>pose "), 1U);
}

TEST_F(Page, TheSameInputIsTheSamePage) {
  write_all();
  (void)reported();
  const std::string first = page();
  (void)reported();
  EXPECT_TRUE(page() == first);
}

TEST_F(Page, ATinyMapOfOneTexelHasAPageToo) {
  header_ = test::header_of(1, 1, {test::pose_of(0, {0, 0, 1}, {0.1, 0, 1})});
  map_ = test::map_of(header_, material);
  write_all();
  EXPECT_TRUE(reported().empty());
  EXPECT_THAT(page(), HasSubstr("1 x 1 texels"));
}

TEST_F(Page, RefusesTheMapOfAnotherSample) {
  write_all();
  auto header = header_;
  header.rows = kRows - 1;
  map_ = test::map_of(header, material);
  write_map();
  const base::Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::bad_input);
  EXPECT_EQ(error.where, options_.maps[0].string());
  map_ = test::regions_of(header_, 0.1F);
  write_map();
  EXPECT_EQ(refused().code, ErrorCode::bad_input) << "a map of no material";
}

TEST_F(Page, RefusesFilesThatAreNoMaps) {
  EXPECT_EQ(refused().code, ErrorCode::not_found);
  write_observation();
  EXPECT_EQ(refused().code, ErrorCode::not_found);
  write_map();
  const std::string whole = test::bytes_in(options_.maps[0]);
  test::put_bytes(options_.maps[0], whole.substr(0, whole.size() / 2));
  EXPECT_EQ(refused().where, options_.maps[0].string());
  test::put_bytes(options_.maps[0], whole);
  test::put_bytes(options_.observation, "no map");
  EXPECT_EQ(refused().where, options_.observation.string());
  options_.maps.clear();
  EXPECT_EQ(refused().code, ErrorCode::bad_input);
}

TEST_F(Page, RefusesATruthWhoseRegionsAreOfAnotherMap) {
  write_all();
  write_truth();
  auto header = header_;
  header.columns = 2;
  write_regions(test::regions_of(header, 0.3F));
  const base::Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::bad_input);
  EXPECT_EQ(error.where, (folder_ / "truth.regions.exr").string());
  std::filesystem::remove(folder_ / "truth.regions.exr");
  EXPECT_EQ(refused().code, ErrorCode::not_found);
}

TEST_F(Page, NeverTakesThePlaceOfWhatItIsMadeFrom) {
  write_all();
  const std::string before = test::bytes_in(options_.observation);
  for (const auto& source : {options_.observation, options_.maps[0]}) {
    options_.out = source;
    EXPECT_EQ(refused().code, ErrorCode::refused);
  }
  EXPECT_TRUE(test::bytes_in(options_.observation) == before);
}

TEST_F(Page, InterruptedLeavesThePageOfYesterday) {
  write_all();
  test::put_bytes(options_.out, "the page of yesterday");
  EXPECT_EQ(test::in_child([this] {
              base::catch_interrupts();
              if (::raise(SIGINT) != 0) return 2;
              const auto figures = write_report(options_);
              return !figures && figures.error().code == ErrorCode::interrupted ? 0 : 1;
            }),
            0);
  EXPECT_EQ(page(), "the page of yesterday");
}

}  // namespace
}  // namespace rig::report
