// job.toml: there and back, its mistakes, and whether the rig can do it.
#include "core/machine/job_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/base/units.h"
#include "tests/core/machine/rig_file.h"
#include "tests/core/seed.h"

namespace rig::machine {
namespace {

using base::radians;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kJob = R"(format = 1
name = "first"
sample = "cloth"
operator = "A. B."

[exposure]
strategy = "fixed"
exposures_us = [160000, 20000, 2500]

[retry]
attempts = 5
delay_s = 0.5

[poses]
# roll, tilt, pan, arm
angles_deg = [
  [0, 10, -20.5, 45],
  [-170.0, -10, 20.5, 90],
]
)";

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string complaints(const std::string& text) {
  const auto job = parse_job_config(text, "job.toml");
  return job ? "no complaint" : job.error().text();
}

TEST(JobConfig, ReadsEveryKey) {
  const auto job = parse_job_config(kJob, "job.toml");
  ASSERT_TRUE(job.has_value()) << job.error().text();
  EXPECT_EQ(job->name, "first");
  EXPECT_EQ(job->sample, "cloth");
  EXPECT_EQ(job->operator_name, "A. B.");
  EXPECT_EQ(job->exposure.strategy, ExposureStrategy::fixed);
  EXPECT_THAT(
      job->exposure.exposures_s,
      testing::ElementsAre(testing::DoubleEq(0.16), testing::DoubleEq(0.02), testing::DoubleEq(0.0025)));
  EXPECT_EQ(job->retry.attempts, 5);
  EXPECT_EQ(job->retry.delay_s, 0.5);
  ASSERT_EQ(job->poses.size(), 2U);
  EXPECT_EQ(job->poses[1], (JointAngles{radians(-170.0), radians(-10), radians(20.5), radians(90)}));
}

TEST(JobConfig, HalvingHasItsOwnKeys) {
  const std::string text =
      changed(kJob, "strategy = \"fixed\"\nexposures_us = [160000, 20000, 2500]",
              "strategy = \"halve\"\nlongest_us = 500000\nmost_frames = 8\nsaturated_share = 0.001");
  const auto job = parse_job_config(text, "job.toml");
  ASSERT_TRUE(job.has_value()) << job.error().text();
  EXPECT_EQ(job->exposure.strategy, ExposureStrategy::halve);
  EXPECT_DOUBLE_EQ(job->exposure.longest_s, 0.5);
  EXPECT_EQ(job->exposure.most_frames, 8);
  EXPECT_EQ(job->exposure.saturated_share, 0.001);
  EXPECT_THAT(complaints(changed(text, "most_frames", "exposures_us = [1]\nmost_frames")),
              HasSubstr("job.toml:9:1: exposure.exposures_us: unknown key"))
      << "a key of the other strategy would be ignored in silence";
}

const std::string kFixedLines = "strategy = \"fixed\"\nexposures_us = [160000, 20000, 2500]";

TEST(JobConfig, PredictionHasItsOwnKeys) {
  const std::string text = changed(kJob, kFixedLines,
                                   "strategy = \"predicted\"\nlightest_us = [8000, 500]\n"
                                   "darkest_us = [500000, 8000]\nlightest_deg = 2");
  const auto job = parse_job_config(text, "job.toml");
  ASSERT_TRUE(job.has_value()) << job.error().text();
  EXPECT_EQ(job->exposure.strategy, ExposureStrategy::predicted);
  EXPECT_THAT(job->exposure.darkest_s,
              testing::ElementsAre(testing::DoubleEq(0.5), testing::DoubleEq(0.008)));
  EXPECT_DOUBLE_EQ(job->exposure.lightest_rad, radians(2));
  EXPECT_DOUBLE_EQ(job->exposure.darkest_rad, radians(90));
  EXPECT_THAT(complaints(changed(text, "[8000, 500]", "[8000]")),
              HasSubstr("job.toml:9:14: exposure.darkest_us: has 2 exposures, lightest_us has 1"));
  EXPECT_THAT(complaints(changed(text, "[8000, 500]", "[8000, 9000]")),
              HasSubstr("exposure.lightest_us: must begin"));
  EXPECT_THAT(complaints(changed(text, "[500000, 8000]", "[500000, 400]")),
              HasSubstr("exposure.darkest_us: exposure 2 is shorter"));
  EXPECT_THAT(complaints(changed(text, "lightest_deg = 2", "lightest_deg = 90")),
              HasSubstr("exposure.darkest_deg: must be greater"));
  EXPECT_THAT(complaints(changed(text, "lightest_deg = 2", "lightest_deg = 190")),
              HasSubstr("job.toml:10:16: exposure.lightest_deg"));
}

TEST(JobConfig, AdaptationHasItsOwnKeys) {
  const std::string text = changed(kJob, kFixedLines,
                                   "strategy = \"adaptive\"\nfirst_us = 8000\nlongest_us = 500000\n"
                                   "most_frames = 4\nsnr = 30\nshort_share = 0.02");
  const auto job = parse_job_config(text, "job.toml");
  ASSERT_TRUE(job.has_value()) << job.error().text();
  EXPECT_EQ(job->exposure.strategy, ExposureStrategy::adaptive);
  EXPECT_DOUBLE_EQ(job->exposure.first_s, 0.008);
  EXPECT_DOUBLE_EQ(job->exposure.longest_s, 0.5);
  EXPECT_EQ(job->exposure.most_frames, 4);
  EXPECT_EQ(job->exposure.snr, 30);
  EXPECT_EQ(job->exposure.short_share, 0.02);
  EXPECT_THAT(complaints(changed(text, "first_us = 8000", "first_us = 600000")),
              HasSubstr("job.toml:8:12: exposure.first_us: is longer than longest_us"));
  EXPECT_THAT(complaints(changed(text, "snr = 30", "snr = 0")), HasSubstr("job.toml:11:7: exposure.snr"));
  EXPECT_THAT(complaints(changed(text, "most_frames = 4", "most_frames = 17")),
              HasSubstr("exposure.most_frames"));
  EXPECT_THAT(complaints(changed(text, "short_share = 0.02", "short_share = 2")),
              HasSubstr("exposure.short_share"));
}

TEST(JobConfig, MistakesNameTheirPlace) {
  EXPECT_THAT(complaints(changed(kJob, "attempts = 5", "attempts = 0")),
              HasSubstr("job.toml:11:12: retry.attempts"));
  EXPECT_THAT(complaints(changed(kJob, "[160000, 20000, 2500]", "[]")),
              HasSubstr("exposure.exposures_us: names no"));
  EXPECT_THAT(complaints(changed(kJob, "[160000, 20000, 2500]", "[2500, 20000]")),
              HasSubstr("must begin with the longest"));
  EXPECT_THAT(complaints(changed(kJob, "[160000, 20000, 2500]", "[160000, -1]")), HasSubstr("item 2"));
  EXPECT_THAT(complaints(changed(kJob, "20.5, 90]", "20.5]")),
              HasSubstr("row 2 (line 18) must be 4 numbers"));
  EXPECT_THAT(complaints(changed(kJob, "20.5, 90]", "20.5, nan]")),
              HasSubstr("row 2 (line 18) must be 4 numbers"));
  EXPECT_THAT(complaints(changed(kJob, "sample =", "sampel =")), HasSubstr("sampel: unknown key"));
  EXPECT_THAT(complaints(changed(kJob, "\"fixed\"", "\"clever\"")),
              HasSubstr("exposure.strategy: is 'clever'"));
  EXPECT_THAT(complaints("format = 1\nname = \"a\"\nsample = \"b\"\n[exposure]\nstrategy = \"fixed\"\n"
                         "exposures_us = [1.0]\n[poses]\nangles_deg = []\n"),
              HasSubstr("poses.angles_deg: has no pose"));
  const auto newer = parse_job_config(changed(kJob, "format = 1", "format = 2"), "job.toml");
  ASSERT_FALSE(newer.has_value());
  EXPECT_EQ(newer.error().code, base::ErrorCode::newer);
}

void expect_same(const JobConfig& a, const JobConfig& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.sample, b.sample);
  EXPECT_EQ(a.operator_name, b.operator_name);
  EXPECT_EQ(a.exposure.strategy, b.exposure.strategy);
  EXPECT_EQ(a.exposure.exposures_s, b.exposure.exposures_s);
  EXPECT_EQ(a.exposure.longest_s, b.exposure.longest_s);
  EXPECT_EQ(a.exposure.most_frames, b.exposure.most_frames);
  EXPECT_EQ(a.exposure.saturated_share, b.exposure.saturated_share);
  EXPECT_EQ(a.exposure.lightest_s, b.exposure.lightest_s);
  EXPECT_EQ(a.exposure.darkest_s, b.exposure.darkest_s);
  EXPECT_EQ(a.exposure.lightest_rad, b.exposure.lightest_rad);
  EXPECT_EQ(a.exposure.darkest_rad, b.exposure.darkest_rad);
  EXPECT_EQ(a.exposure.first_s, b.exposure.first_s);
  EXPECT_EQ(a.exposure.snr, b.exposure.snr);
  EXPECT_EQ(a.exposure.short_share, b.exposure.short_share);
  EXPECT_EQ(a.retry.attempts, b.retry.attempts);
  EXPECT_EQ(a.retry.delay_s, b.retry.delay_s);
  EXPECT_EQ(a.poses, b.poses);
}

TEST(JobConfig, FormattedJobsReadBackBitForBit) {
  base::Random random(test::seed(40));
  for (int round = 0; round < 200; ++round) {
    JobConfig job;
    job.name = "odd \"name\" \\ with\ttab, line\nbreak and umlaut \xc3\xa4";
    job.sample = round % 2 == 0 ? "" : "# no comment = 1";
    job.operator_name = round % 3 == 0 ? "" : "C";
    if (round % 4 == 1) {
      job.exposure.strategy = ExposureStrategy::adaptive;
      job.exposure.first_s = random.uniform(1, 1e4) * 1e-6;
      job.exposure.longest_s = random.uniform(1e4, 1e7) * 1e-6;
      job.exposure.most_frames = 7;
      job.exposure.snr = random.uniform(1, 100);
      job.exposure.short_share = random.uniform();
    } else if (round % 4 == 2) {
      job.exposure.strategy = ExposureStrategy::predicted;
      job.exposure.lightest_s = {random.uniform(100, 1e4) * 1e-6, random.uniform(1, 100) * 1e-6};
      job.exposure.darkest_s = {random.uniform(1e4, 1e7) * 1e-6, random.uniform(100, 1e4) * 1e-6};
      job.exposure.lightest_rad = radians(random.uniform(0, 40));
      job.exposure.darkest_rad = radians(random.uniform(40, 180));
    } else if (round % 2 == 0) {
      double us = random.uniform(1e4, 1e6);
      while (us > 10) {
        job.exposure.exposures_s.push_back(us * 1e-6);
        us *= random.uniform(0.1, 0.9);
      }
    } else {
      job.exposure = {ExposureStrategy::halve, {}, random.uniform(1, 1e7) * 1e-6, 5, random.uniform()};
    }
    job.retry = {3, random.uniform(0, 10)};
    for (int i = 0; i < 50; ++i) {
      JointAngles pose{};
      for (double& angle : pose) angle = radians(random.uniform(-400, 400));
      job.poses.push_back(pose);
    }
    job.poses.push_back({0.0, radians(1e-9), radians(-90), radians(180)});
    const auto again = parse_job_config(format_job_config(job, "two\nlines"), "job.toml");
    ASSERT_TRUE(again.has_value()) << again.error().text();
    expect_same(job, *again);
  }
}

TEST(JobConfig, FormattedAnglesReadAsAPersonWroteThem) {
  const auto job = parse_job_config(kJob, "job.toml");
  const std::string text = format_job_config(*job, "a comment\nof two lines");
  EXPECT_THAT(text, HasSubstr("# a comment\n# of two lines\n"));
  EXPECT_THAT(text, HasSubstr("exposures_us = [160000.0, 20000.0, 2500.0]"));
  EXPECT_THAT(text, HasSubstr("  [0.0, 10.0, -20.5, 45.0],\n  [-170.0, -10.0, 20.5, 90.0],\n"));
  // Every tenth of a degree, whatever its conversion to radians does to the last digit.
  JobConfig tenths = *job;
  tenths.poses.clear();
  for (int i = -1800; i <= 1800; ++i) tenths.poses.push_back({radians(i / 10.0), 0, 0, 0});
  const std::string all = format_job_config(tenths, "");
  for (int i = -1800; i <= 1800; ++i)
    EXPECT_THAT(all, HasSubstr(fmt::format("  [{:.1f}, 0.0", i / 10.0 + 0.0)));
}

TEST(CheckJob, AcceptsWhatTheRigCanDo) {
  const auto ok = check_job(rig_with({}), *parse_job_config(kJob, "job.toml"));
  EXPECT_TRUE(ok.has_value()) << ok.error().text();
}

TEST(CheckJob, NamesPoseAndAxis) {
  auto job = *parse_job_config(kJob, "job.toml");
  job.poses.insert(job.poses.begin() + 1, {0, radians(76), 0, radians(45)});
  job.poses.push_back({0, 0, 0, radians(9.99)});
  job.poses.push_back({0, 0, std::nan(""), radians(45)});
  const auto checked = check_job(rig_with({}), job);
  ASSERT_FALSE(checked.has_value());
  const std::string text = checked.error().text();
  EXPECT_THAT(
      text, HasSubstr("pose 1: axis tilt may not go to 76.0000 deg: its limits are -75.0000 to 75.0000 deg"));
  EXPECT_THAT(text, HasSubstr("pose 3: axis arm may not go to 9.9900 deg"));
  EXPECT_THAT(text, HasSubstr("pose 4: axis pan"));
  EXPECT_THAT(text, Not(HasSubstr("pose 0:")));
  EXPECT_THAT(text, Not(HasSubstr("pose 2:"))) << "the way to it begins at the last pose that is allowed";
}

TEST(CheckJob, LooksAtTheWayBetweenPosesToo) {
  // The light stands on either side of a camera that it may not pass.
  const RigConfig rig =
      rig_with({{"min_deg = 10.0", "min_deg = -60.0"}, {"clearance_mm = 30.0", "clearance_mm = 100.0"}});
  auto job = *parse_job_config(kJob, "job.toml");
  job.poses = {{0, 0, 0, radians(40)}, {0, 0, 0, radians(-40)}, {0, 0, 0, radians(50)}};
  const auto checked = check_job(rig, job);
  ASSERT_FALSE(checked.has_value());
  EXPECT_THAT(checked.error().text(), HasSubstr("pose 1: keep-out 'light and camera': on the way"));
  EXPECT_THAT(checked.error().text(), Not(HasSubstr("pose 2")));
}

TEST(CheckJob, ExposuresMustBeTheCameras) {
  auto job = *parse_job_config(kJob, "job.toml");
  job.exposure.exposures_s = {3.0, 0.01, 1e-6};
  auto checked = check_job(rig_with({}), job);
  ASSERT_FALSE(checked.has_value());
  EXPECT_THAT(checked.error().text(), HasSubstr("3000000.000 us"));
  EXPECT_THAT(checked.error().text(), HasSubstr("1.000 us"));
  EXPECT_THAT(checked.error().text(), Not(HasSubstr("10000.000 us")));
  job.exposure = {ExposureStrategy::halve, {}, 0.001, 6, 0};
  checked = check_job(rig_with({}), job);
  ASSERT_FALSE(checked.has_value()) << "31.25 us, the last of six, is shorter than the camera can";
  EXPECT_THAT(checked.error().text(), HasSubstr("31.250 us"));
}

}  // namespace
}  // namespace rig::machine
