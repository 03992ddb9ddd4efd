// What a job would take, and what refuses it before anything moves.
#include "daemon/preflight.h"

#include "daemon/space.h"
#include "tests/daemon/job_fixture.h"

namespace rig::daemon::testing {
namespace {

class PreflightTest : public JobTest {
 protected:
  protocol::Preflight check(const machine::JobConfig& job) const {
    return preflight(setup_, model_->state(), job);
  }
};

TEST_F(PreflightTest, ForeseesTheDurationOfAJob) {
  const machine::JobConfig job = small_job(5);
  const auto flight = check(job);
  EXPECT_TRUE(flight.ok());
  EXPECT_EQ(flight.poses(), 5U);
  EXPECT_EQ(flight.frames(), 10U);
  const auto begin = model_->now();
  add_job(job);
  run_to_completion();
  const double took = base::to_seconds(model_->now() - begin);
  EXPECT_NEAR(flight.duration_s(), took, 0.15 * took);
}

TEST_F(PreflightTest, CountsEveryByteOfTheFrames) {
  const auto& size = setup_.rig.camera.intrinsics;
  const double pixels = 2.0 * size.width * size.height;
  const auto flight = check(small_job(5));
  EXPECT_GE(static_cast<double>(flight.bytes_needed()), 10 * pixels);
  EXPECT_LE(static_cast<double>(flight.bytes_needed()), 10.1 * pixels);
}

TEST_F(PreflightTest, TheMostThatHalvingCanTake) {
  machine::JobConfig job = small_job(1);
  job.exposure = {};
  job.exposure.strategy = machine::ExposureStrategy::halve;
  job.exposure.longest_s = 0.4;
  job.exposure.most_frames = 3;
  EXPECT_EQ(check(job).frames(), 3U);
  EXPECT_NEAR(bracket_s(setup_, job.exposure), 0.4 + 0.2 + 0.1 + 2 * setup_.camera.readout_s, 1e-12);
}

TEST_F(PreflightTest, NamesEachProblem) {
  machine::JobConfig job = small_job(2);
  job.poses[1][2] = 5;
  EXPECT_FALSE(check(job).ok());
  EXPECT_NE(check(job).problems(0).find("pose 1"), std::string::npos);
  setup_.rig.unattended.lamp_life_hours = 1e-6;
  EXPECT_EQ(check(job).problems_size(), 2);
  EXPECT_NE(check(job).problems(1).find("life_hours"), std::string::npos);
}

TEST_F(PreflightTest, AnyClientMayAskAndNothingMoves) {
  protocol::Request request;
  request.mutable_check_job()->set_job_toml(machine::format_job_config(small_job(3), "a test"));
  model_->request(request, protocol::Role::observer);
  run_until([&] { return !model_->replies().empty(); });
  EXPECT_EQ(model_->replies().back().preflight().poses(), 3U);
  run_for(10);
  EXPECT_TRUE(actions<MoveAxis>().empty());
  EXPECT_TRUE(actions<CreateJob>().empty());
}

TEST_F(PreflightTest, SubmittingRefusesWhatTheCheckRefuses) {
  setup_.rig.unattended.lamp_life_hours = 1e-6;
  restart();
  protocol::Request request;
  request.mutable_submit_job()->set_job_toml(machine::format_job_config(small_job(3), "a test"));
  request.mutable_submit_job()->set_scan_folder("/scan");
  const auto& reply = ask(request);
  EXPECT_EQ(reply.outcome(), protocol::REFUSED);
  EXPECT_NE(reply.reason().find("lamp"), std::string::npos) << reply.reason();
}

TEST_F(PreflightTest, TheEventsOfAPoseGoIntoItsCommit) {
  add_job(small_job(2));
  run_to_completion();
  const auto commits = actions<CommitPose>();
  ASSERT_EQ(commits.size(), 2U);
  for (const CommitPose& commit : commits) {
    std::vector<std::string> kinds;
    for (const scan::EventRecord& record : commit.events) {
      protocol::Event event;
      ASSERT_TRUE(event.ParseFromString(record.payload));
      EXPECT_EQ(event.number(), record.number);
      kinds.push_back(event.has_pose_started()   ? "started"
                      : event.has_pose_arrived() ? "arrived"
                      : event.has_frame_taken()  ? "frame"
                                                 : "?");
    }
    EXPECT_EQ(kinds, (std::vector<std::string>{"started", "arrived", "frame", "frame"}));
  }
  // Every event is kept once: with a pose or on its own.
  std::set<std::uint64_t> numbers;
  for (const CommitPose& commit : commits) {
    for (const auto& record : commit.events) EXPECT_TRUE(numbers.insert(record.number).second);
  }
  for (const KeepEvent& kept : actions<KeepEvent>()) EXPECT_TRUE(numbers.insert(kept.event.number).second);
  EXPECT_EQ(numbers.size(), model_->events().size());
}

TEST_F(PreflightTest, SuspensionAndEndAreTold) {
  add_job(small_job(5));
  run_until([&] { return entry().done >= 1 && model_->state().frame; });
  model_->gone.insert("camera");
  run_until([&] { return resting(); });
  model_->gone.clear();
  EXPECT_EQ(hold(1, "by hand").outcome(), protocol::DONE);  // an operator knows of it
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(occasions(), (std::vector<std::string>{"suspended", "complete"}));
}

}  // namespace
}  // namespace rig::daemon::testing
