// What the morning report says of a job that had everything happen to it.
#include "daemon/report.h"

#include <gtest/gtest.h>

#include "protocol/report_text.h"

namespace rig::daemon {
namespace {

using base::seconds;

scan::EventRecord record(std::uint64_t number, protocol::Event event) {
  event.set_time_us(static_cast<std::int64_t>(number) * 1000000);
  return {1, number, base::Time(seconds(static_cast<double>(number))), event.SerializeAsString()};
}

scan::EventRecord failed(std::uint64_t number, std::uint64_t job, std::int64_t row, const std::string& why) {
  protocol::Event event;
  event.mutable_pose_failed()->set_job(job);
  event.mutable_pose_failed()->set_row(row);
  event.mutable_pose_failed()->set_reason(why);
  return record(number, event);
}

scan::EventRecord suspended(std::uint64_t number, const std::string& condition, const std::string& why) {
  protocol::Event event;
  event.mutable_job_suspended()->set_job(7);
  event.mutable_job_suspended()->set_condition(condition);
  event.mutable_job_suspended()->set_reason(why);
  return record(number, event);
}

scan::EventRecord released(std::uint64_t number, const std::string& condition, double suspended_s) {
  protocol::Event event;
  event.mutable_job_released()->set_job(7);
  event.mutable_job_released()->set_condition(condition);
  event.mutable_job_released()->set_suspended_s(suspended_s);
  return record(number, event);
}

scan::PoseRecord pose(std::int64_t row, double arrived_s) {
  scan::PoseRecord record;
  record.row = row;
  record.arrived = base::Time(seconds(arrived_s));
  record.committed = base::Time(seconds(arrived_s + 2));
  record.frames.resize(3);
  return record;
}

protocol::Report some_report() {
  protocol::JobInfo job;
  job.set_job(7);
  job.set_name("denim");
  job.set_state(protocol::COMPLETE);
  job.set_scan_folder("/scans/7");
  const std::vector<scan::PlanRow> plan{
      {0, {}, scan::RowState::done, 0, ""},
      {1, {}, scan::RowState::done, 1, ""},
      {2, {}, scan::RowState::abandoned, 2, "axis pan stands elsewhere"},
      {3, {}, scan::RowState::abandoned, 3, "told by the journal alone"},
      {4, {}, scan::RowState::pending, 0, ""},
  };
  return make_report(
      job, plan, {pose(0, 100), pose(1, 110)},
      {failed(5, 7, 1, "it slipped"), failed(8, 7, 2, "the first time"), failed(9, 7, 2, "the second time"),
       failed(10, 6, 0, "of another job"), suspended(3, "light", "the lamp is dim"), released(4, "light", 90),
       suspended(12, "disk", "full"), record(20, {})});
}

TEST(Report, AccountsForEveryPoseWithItsReasons) {
  const protocol::Report report = some_report();
  ASSERT_EQ(report.poses_size(), 5);
  EXPECT_EQ(report.poses(0).state(), "done");
  EXPECT_EQ(report.poses(0).reasons_size(), 0);
  EXPECT_EQ(report.poses(0).arrived_us(), 100000000);
  EXPECT_EQ(report.poses(0).committed_us(), 102000000);
  EXPECT_EQ(report.poses(1).failures(), 1U);
  EXPECT_EQ(report.poses(1).reasons(0), "it slipped");
  EXPECT_EQ(report.poses(2).state(), "abandoned");
  ASSERT_EQ(report.poses(2).reasons_size(), 2);
  EXPECT_EQ(report.poses(2).reasons(1), "the second time");
  EXPECT_EQ(report.poses(3).reasons(0), "told by the journal alone");
  EXPECT_EQ(report.poses(4).state(), "pending");
  EXPECT_EQ(report.frames(), 6U);
  EXPECT_NEAR(report.seconds_per_pose(), 10, 1e-9);
}

TEST(Report, PairsSuspensionsWithTheirEnds) {
  const protocol::Report report = some_report();
  ASSERT_EQ(report.suspensions_size(), 2);
  EXPECT_EQ(report.suspensions(0).condition(), "light");
  EXPECT_EQ(report.suspensions(0).suspended_s(), 90);
  EXPECT_EQ(report.suspensions(1).condition(), "disk");
  EXPECT_EQ(report.suspensions(1).suspended_s(), 0);
  EXPECT_EQ(report.suspended_s(), 90);
}

TEST(Report, TellsAPersonWhatWentWrongAndNothingElseOfPoses) {
  const std::string text = protocol::report_text(some_report());
  EXPECT_NE(text.find("Job 7 'denim'"), std::string::npos) << text;
  EXPECT_NE(text.find("5 planned, 2 done (1 of them after retries), 2 abandoned, 1 pending"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("the lamp is dim; 0:01:30 h"), std::string::npos) << text;
  EXPECT_NE(text.find("row 2: abandoned after 2 failed attempts"), std::string::npos) << text;
  EXPECT_EQ(text.find("row 0"), std::string::npos) << text;
  EXPECT_EQ(text.find("another job"), std::string::npos) << text;
}

scan::EventRecord changed(std::uint64_t epoch, std::uint64_t number, std::uint64_t job,
                          protocol::JobState state) {
  protocol::Event event;
  event.mutable_job_changed()->mutable_job()->set_job(job);
  event.mutable_job_changed()->mutable_job()->set_state(state);
  scan::EventRecord record = daemon::record(number, event);
  record.epoch = epoch;
  return record;
}

TEST(Report, TellsOfEachStartOfRigdThatTheJobWentOnAfter) {
  protocol::JobInfo job;
  job.set_job(7);
  const std::vector<scan::EventRecord> events{
      changed(1, 1, 7, protocol::QUEUED),    changed(2, 2, 7, protocol::HELD),
      changed(3, 30, 7, protocol::ACTIVE),   changed(4, 5, 8, protocol::ACTIVE),
      changed(5, 90, 7, protocol::COMPLETE), changed(5, 70, 7, protocol::ACTIVE),
      changed(4, 60, 7, protocol::HELD)};
  const protocol::Report report = make_report(job, {}, {}, events, {});
  ASSERT_EQ(report.restarts_us_size(), 2) << "not those before it began";
  EXPECT_EQ(report.restarts_us(0), 60'000'000);
  EXPECT_EQ(report.restarts_us(1), 70'000'000);
  EXPECT_NE(protocol::report_text(report).find("Restarted: rigd was started anew 2 times while the job was "
                                               "under way: 1970-01-01 00:01:00 UTC, 1970-01-01 00:01:10 UTC"),
            std::string::npos)
      << protocol::report_text(report);
  EXPECT_EQ(protocol::report_text(some_report()).find("Restarted"), std::string::npos);
}

TEST(Report, IsJsonWithTheNamesOfTheProtocol) {
  const auto json = protocol::report_json(some_report());
  ASSERT_TRUE(json.has_value()) << json.error().text();
  EXPECT_NE(json->find("\"seconds_per_pose\""), std::string::npos);
  EXPECT_NE(json->find("\"it slipped\""), std::string::npos);
}

scan::VisitRecord visited(std::int64_t number, bool good, const std::string& what, double patch) {
  return {number,
          base::Time(seconds(100.0 * static_cast<double>(number))),
          good,
          what,
          {{"patches", "", 0.02, {}, "", {patch}}}};
}

// The first is no bad one, and drift is told of the light that the frames are of.
TEST(Report, TellsOfVisitsByTheLightThatTheScanIsIn) {
  const protocol::Report report = make_report(
      {}, {}, {}, {},
      {visited(0, false, "", 800), visited(1, true, "", 808), visited(2, false, "too bright", 1000),
       visited(3, true, "3 visits agree with each other", 1000), visited(4, true, "", 990)});
  ASSERT_EQ(report.visits_size(), 5);
  EXPECT_EQ(report.visits(0).level(), 0) << "nothing to compare with";
  EXPECT_DOUBLE_EQ(report.visits(1).level(), 1);
  EXPECT_DOUBLE_EQ(report.visits(3).level(), 1);
  EXPECT_DOUBLE_EQ(report.visits(4).level(), 0.99);
  const std::string text = protocol::report_text(report);
  EXPECT_NE(text.find("Reference: 5 visits; the patches between 0.9900 and 1.0000 of the first"),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("visit 0:"), std::string::npos) << text;
  EXPECT_NE(text.find("visit 2: too bright"), std::string::npos) << text;
  EXPECT_NE(text.find("visit 3: 3 visits agree with each other"), std::string::npos) << text;
}

}  // namespace
}  // namespace rig::daemon
