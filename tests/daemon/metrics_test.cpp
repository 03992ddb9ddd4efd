// What a night leaves behind: the line of statistics, and records with fields.
#include "daemon/metrics.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/journal_log.h"
#include "daemon/log_event.h"
#include "tests/core/temporary_folder.h"

namespace rig::daemon {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

protocol::Metrics metrics_with(double frames, double stores, double store_s) {
  protocol::Metrics metrics;
  const auto put = [&](const char* name, double value, const char* bus = "") {
    auto& metric = *metrics.add_metrics();
    metric.set_name(name);
    metric.set_value(value);
    metric.set_bus(bus);
  };
  put("rig_frames_total", frames);
  put("rig_stores_total", stores);
  put("rig_store_seconds_total", store_s);
  put("rig_bus_waiting", 3, "virtual/axes");
  return metrics;
}

TEST(Metrics, TheLineTellsWhatGrewAndTheMeanSinceTheLineBefore) {
  const std::string line = statistics_line(metrics_with(30, 20, 0.5), metrics_with(12, 10, 0.1));
  EXPECT_THAT(line, HasSubstr("Stats: "));
  EXPECT_THAT(line, HasSubstr("frames 30 (+18)"));
  EXPECT_THAT(line, HasSubstr("store 40.0 ms"));
  EXPECT_THAT(line, HasSubstr("bus virtual/axes 0.00 ms worst 0.0 waiting 3"));
}

TEST(Metrics, TheJournalGetsEachNumberAsAField) {
  const auto fields = statistics_fields(metrics_with(30, 20, 0.5));
  ASSERT_EQ(fields.size(), 4U);
  EXPECT_EQ(fields[0].name + "=" + fields[0].value, "RIG_FRAMES_TOTAL=30");
  EXPECT_EQ(fields[3].name + "=" + fields[3].value, "RIG_BUS_WAITING_VIRTUAL_AXES=3");
}

TEST(Metrics, CountersCountWhatIsPublished) {
  Counters counters;
  protocol::Event event;
  event.mutable_pose_failed()->set_abandoned(true);
  counters.count(event);
  event.mutable_pose_failed()->set_abandoned(false);
  counters.count(event);
  event.mutable_pose_committed();
  counters.count(event);
  EXPECT_EQ(counters.failures, 2U);
  EXPECT_EQ(counters.abandoned, 1U);
  EXPECT_EQ(counters.poses, 1U);
  EXPECT_EQ(counters.frames, 0U);
}

TEST(Metrics, TimingsKeepTheWorstUntilItIsForgotten) {
  Timings timings;
  timings.add(std::chrono::milliseconds(30));
  timings.add(std::chrono::milliseconds(10));
  EXPECT_EQ(timings.summary().count, 2U);
  EXPECT_DOUBLE_EQ(timings.summary().total_s, 0.04);
  EXPECT_DOUBLE_EQ(timings.summary().worst_s, 0.03);
  timings.forget_worst();
  timings.add(std::chrono::milliseconds(5));
  EXPECT_DOUBLE_EQ(timings.summary().worst_s, 0.005);
}

TEST(JournalLog, OnlyTheStreamThatSystemdNamedIsTheJournal) {
  const test::TemporaryFolder folder;
  const int fd = ::open((folder / "stream").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  struct stat is {};
  ASSERT_EQ(::fstat(fd, &is), 0);
  EXPECT_TRUE(goes_to_journal(fd, fmt::format("{}:{}", is.st_dev, is.st_ino).c_str()));
  EXPECT_FALSE(goes_to_journal(fd, fmt::format("{}:{}", is.st_dev, is.st_ino + 1).c_str()));
  EXPECT_FALSE(goes_to_journal(fd, nullptr));
  ::close(fd);
}

TEST(JournalLog, ARecordHasItsMessagePriorityAndFields) {
  const std::vector<base::LogField> fields{{"RIG_ROW", "17"}};
  EXPECT_THAT(journal_entry(base::LogLevel::warning, "it slipped", fields, "rigd"),
              ElementsAre("MESSAGE=it slipped", "PRIORITY=4", "SYSLOG_IDENTIFIER=rigd", "RIG_ROW=17"));
}

TEST(LogEvent, AFailedPoseLeavesALineWithItsRowAndReason) {
  std::string line;
  std::vector<std::string> fields;
  base::set_log_sink([&](base::LogLevel, std::string_view message, std::span<const base::LogField> with) {
    line = message;
    for (const auto& field : with) fields.push_back(field.name + "=" + field.value);
  });
  protocol::Event event;
  event.mutable_pose_failed()->set_row(17);
  event.mutable_pose_failed()->set_job(3);
  event.mutable_pose_failed()->set_reason("it slipped");
  log_event(event);
  EXPECT_EQ(line, "row 17: it slipped");
  EXPECT_THAT(fields, Contains("RIG_EVENT=pose_failed"));
  EXPECT_THAT(fields, Contains("RIG_ROW=17"));
  EXPECT_THAT(fields, Contains("RIG_JOB=3"));
  EXPECT_THAT(fields, Contains("RIG_REASON=it slipped"));
  line.clear();
  event.mutable_pose_started();
  log_event(event);
  EXPECT_EQ(line, "");
  base::set_log_sink({});
}

}  // namespace
}  // namespace rig::daemon
