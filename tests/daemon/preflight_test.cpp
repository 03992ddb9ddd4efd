// What a job would take, and what refuses it before anything moves.
#include "daemon/preflight.h"

#include <array>
#include <gmock/gmock.h>

#include "core/machine/exposure_bounds.h"
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

// One of each strategy. What halving and adapting take depends on the frames.
std::vector<machine::ExposureConfig> one_of_each() {
  using machine::ExposureStrategy;
  machine::ExposureConfig fixed;
  fixed.exposures_s = {0.16, 0.02};
  machine::ExposureConfig halve;
  halve.strategy = ExposureStrategy::halve;
  halve.longest_s = 0.4;
  halve.most_frames = 3;
  machine::ExposureConfig predicted;
  predicted.strategy = ExposureStrategy::predicted;
  predicted.lightest_s = {0.4, 0.02, 0.001};
  predicted.darkest_s = {1.5, 0.3, 0.02};
  predicted.lightest_rad = base::radians(10.0);
  predicted.darkest_rad = base::radians(80.0);
  machine::ExposureConfig adaptive;
  adaptive.strategy = ExposureStrategy::adaptive;
  adaptive.first_s = 0.1;
  adaptive.longest_s = 1.2;
  adaptive.most_frames = 4;
  adaptive.snr = 200;
  return {fixed, halve, predicted, adaptive};
}

class EveryStrategy : public PreflightTest, public ::testing::WithParamInterface<std::size_t> {
 protected:
  [[nodiscard]] std::size_t taken() const {
    std::size_t frames = actions<JudgeLook>().size();
    for (const CommitPose& commit : actions<CommitPose>()) frames += commit.pose.frames.size();
    return frames;
  }
  [[nodiscard]] std::size_t visited() const { return actions<RecordVisit>().size(); }
};

TEST_P(EveryStrategy, ForeseesARunWithItsVisitsAndACoolDown) {
  setup_.rig.unattended.reference = some_reference();
  setup_.rig.light.cool_down_s = 40;
  restart();
  machine::JobConfig job = small_job(5);
  job.exposure = one_of_each().at(GetParam());
  const auto flight = check(job);
  ASSERT_TRUE(flight.ok()) << flight.problems(0);
  EXPECT_EQ(flight.warnings_size(), 0);
  EXPECT_EQ(flight.visits(), 5U);
  const auto begin = model_->now();
  add_job(job);
  run_to_completion();
  const double took_s = base::to_seconds(model_->now() - begin);
  EXPECT_EQ(visited(), flight.visits());
  const auto size = setup_.rig.camera.intrinsics;
  const double pixels = 2.0 * size.width * size.height;
  EXPECT_NEAR(static_cast<double>(flight.bytes_needed()), flight.frames() * pixels,
              0.01 * flight.frames() * pixels);
  const bool depends_on_frames = job.exposure.strategy == machine::ExposureStrategy::halve ||
                                 job.exposure.strategy == machine::ExposureStrategy::adaptive;
  EXPECT_EQ(flight.frames(), 10 + 5U * static_cast<unsigned>(machine::most_frames(job.exposure)));
  EXPECT_LE(took_s, 1.15 * flight.duration_s());
  if (depends_on_frames) {
    EXPECT_LE(taken(), flight.frames());
  } else {
    EXPECT_EQ(taken(), flight.frames());
    EXPECT_GE(took_s, 0.85 * flight.duration_s());
  }
}

std::string strategy_name(const ::testing::TestParamInfo<std::size_t>& strategy) {
  return std::array<const char*, 4>{"Fixed", "Halve", "Predicted", "Adaptive"}.at(strategy.param);
}
INSTANTIATE_TEST_SUITE_P(Preflight, EveryStrategy, ::testing::Values(0, 1, 2, 3), strategy_name);

TEST_F(PreflightTest, TheCoolDownIsWaitedForWhileTheAxesAreHomed) {
  const double without_s = check(small_job(1)).duration_s();
  setup_.rig.light.cool_down_s = 3000;
  EXPECT_NEAR(check(small_job(1)).duration_s() - without_s, 3000, 1e-9);
  // The lamp does not burn meanwhile.
  EXPECT_NEAR(check(small_job(1)).lamp_hours(), without_s / 3600, 1e-9);
}

TEST_F(PreflightTest, VisitsComeByTheClockToo) {
  auto reference = some_reference();
  reference.every_poses = 0;
  reference.every_s = 1e6;
  setup_.rig.unattended.reference = reference;
  EXPECT_EQ(check(small_job(5)).visits(), 3U);  // the first, twice, and the last
  reference.every_s = 1;
  setup_.rig.unattended.reference = reference;
  EXPECT_EQ(check(small_job(5)).visits(), 5U);  // and after each pose that finds another one committed
  restart();
  add_job(small_job(5));
  run_to_completion();
  EXPECT_EQ(actions<RecordVisit>().size(), 5U);
}

TEST_F(PreflightTest, WarnsOfAReferenceThatCannotBeReached) {
  auto reference = some_reference();
  reference.pose_rad = {0, base::radians(85.0), 0, base::radians(60.0)};  // beyond tilt's limit
  setup_.rig.unattended.reference = reference;
  machine::JobConfig job = small_job(3);
  job.sample_fiducials = {1};
  const auto flight = check(job);
  EXPECT_TRUE(flight.ok());
  EXPECT_EQ(flight.visits(), 0U);
  ASSERT_EQ(flight.warnings_size(), 2);
  EXPECT_THAT(flight.warnings(0),
              ::testing::HasSubstr("no reference visit can follow the last pose: axis tilt"));
  EXPECT_THAT(flight.warnings(1), ::testing::HasSubstr("the job will be held"));
}

TEST_F(PreflightTest, WhatIsLeftToWriteEndsAtOneVisit) {
  setup_.rig.unattended.reference = some_reference();
  restart();
  machine::JobConfig job = small_job(5);
  job.exposure = one_of_each().at(2);
  add_job(job);
  run_until([&] { return model_->state().job && model_->state().job->config; });
  const double at_first = bytes_left_to_write(setup_, model_->state());
  EXPECT_NEAR(at_first, static_cast<double>(check(job).bytes_needed()), 1);
  run_until([&] { return entry().done == 5; });
  EXPECT_LE(bytes_left_to_write(setup_, model_->state()), bytes_of_visit(setup_));
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
