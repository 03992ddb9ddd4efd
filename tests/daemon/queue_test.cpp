// The queue as operators handle it: hold, release, order, sample changes, abort and park.
#include "core/base/units.h"
#include "daemon/conditions.h"
#include "tests/daemon/job_fixture.h"

namespace rig::daemon::testing {
namespace {

using base::seconds;
using Strings = std::vector<std::string>;

class QueueTest : public JobTest {};

protocol::Request reorder(std::uint64_t id, std::uint64_t before) {
  protocol::Request request;
  request.mutable_reorder_job()->set_job(id);
  request.mutable_reorder_job()->set_before(before);
  return request;
}

protocol::Request abort_job(std::uint64_t id) {
  protocol::Request request;
  request.mutable_abort_job()->set_job(id);
  return request;
}

TEST_F(QueueTest, AHeldJobRestsAfterThePoseInFlightAndGoesOnWhenReleased) {
  add_job(small_job(5));
  run_until([&] { return entry().done >= 1 && model_->state().job->current; });
  const std::int64_t row = model_->state().job->current->row;
  EXPECT_EQ(hold(1, "looking at the sample").outcome(), protocol::DONE);
  run_until([&] { return resting(); });
  EXPECT_EQ(model_->plan(1).at(static_cast<std::size_t>(row)).state, scan::RowState::done);
  const auto shown = show(1);
  EXPECT_EQ(shown.state(), protocol::HELD);
  EXPECT_EQ(shown.hold(), "looking at the sample");
  EXPECT_TRUE(shown.resting());
  const std::int64_t done = entry().done;
  run_for(100000);  // no time limit
  EXPECT_EQ(entry().done, done);
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+held", "-held"}));
  EXPECT_EQ(entry().done, 5);
}

TEST_F(QueueTest, TheRigMayBeUsedByHandWhileAJobRests) {
  add_job(small_job(4));
  run_until([&] { return entry().done >= 1; });
  protocol::Request move;
  auto& pan = *move.mutable_move()->add_axes();
  pan.set_axis("pan");
  pan.set_angle_deg(5);
  EXPECT_EQ(ask(move).outcome(), protocol::REFUSED);
  EXPECT_EQ(hold(1, "").outcome(), protocol::DONE);
  run_until([&] { return resting(); });
  EXPECT_EQ(ask(move).outcome(), protocol::DONE);
  model_->request(move);
  EXPECT_EQ(release(1).outcome(), protocol::DONE);  // while it moves
  run_to_completion();
  EXPECT_EQ(entry().done, 4);
}

TEST_F(QueueTest, RefusesWhatMakesNoSense) {
  EXPECT_EQ(hold(7, "").outcome(), protocol::REFUSED);
  EXPECT_EQ(release(7).outcome(), protocol::REFUSED);
  add_job(small_job(2));
  EXPECT_EQ(release(1).outcome(), protocol::REFUSED);
  EXPECT_EQ(ask(reorder(1, 0)).outcome(), protocol::REFUSED);  // it runs
  EXPECT_EQ(hold(1, "").outcome(), protocol::DONE);
  EXPECT_EQ(hold(1, "").outcome(), protocol::REFUSED);
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(hold(1, "").outcome(), protocol::REFUSED);
}

TEST_F(QueueTest, AHeldJobInTheQueueLetsOthersPass) {
  add_job(small_job(3), 1);
  run_until([&] { return model_->state().job.has_value(); });
  add_job(small_job(1), 2);
  add_job(small_job(1), 3);
  EXPECT_EQ(hold(2, "not yet").outcome(), protocol::DONE);
  EXPECT_EQ(show(2).state(), protocol::HELD);
  run_to_completion(3);
  run_for(20);
  EXPECT_TRUE(ended(2, JobEntry::State::queued));
  EXPECT_EQ(release(2).outcome(), protocol::DONE);
  run_to_completion(2);
}

TEST_F(QueueTest, TheOrderIsTheOperators) {
  add_job(small_job(3), 1);
  run_until([&] { return model_->state().job.has_value(); });
  for (const std::uint64_t id : {2, 3, 4}) add_job(small_job(1), id);
  EXPECT_EQ(ask(reorder(4, 2)).outcome(), protocol::DONE);
  EXPECT_EQ(ask(reorder(2, 0)).outcome(), protocol::DONE);
  ASSERT_FALSE(actions<SaveOrder>().empty());
  EXPECT_EQ(actions<SaveOrder>().back().jobs, (std::vector<std::uint64_t>{1, 4, 3, 2}));
  EXPECT_EQ(ask(reorder(2, 2)).outcome(), protocol::REFUSED);
  EXPECT_EQ(ask(reorder(2, 9)).outcome(), protocol::REFUSED);
  std::vector<std::uint64_t> opened;
  run_to_completion(2);
  for (const OpenJob& open : actions<OpenJob>()) opened.push_back(open.id);
  EXPECT_EQ(opened, (std::vector<std::uint64_t>{1, 4, 3, 2}));
}

TEST_F(QueueTest, AJobThatNeedsANewSampleWaitsForAPersonBeforeAnythingMoves) {
  machine::JobConfig job = small_job(2);
  job.needs_sample_change = true;
  job.sample = "felt";
  add_job(job, 1);
  add_job(small_job(1), 2);
  run_until([&] { return resting(); });
  run_for(10000);
  EXPECT_TRUE(actions<MoveAxis>().empty());
  EXPECT_TRUE(ended(2, JobEntry::State::queued));  // it may be of the sample that is to come
  const auto shown = show(1);
  EXPECT_EQ(shown.state(), protocol::HELD);
  ASSERT_EQ(shown.suspensions_size(), 1);
  EXPECT_EQ(shown.suspensions(0).condition(), "sample change");
  EXPECT_NE(shown.suspensions(0).reason().find("felt"), std::string::npos);
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion(2);
  EXPECT_EQ(entry(1).done, 2);
}

TEST_F(QueueTest, AnAbortedJobParks) {
  setup_.rig.unattended.park_rad = some_poses()[1];
  restart();
  add_job(small_job(5));
  run_until([&] { return model_->state().motion && entry().done >= 2; });
  EXPECT_EQ(ask(abort_job(1)).outcome(), protocol::DONE);
  run_until([&] { return !model_->state().parking && !model_->state().motion; });
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    EXPECT_NEAR(model_->state().axes[i].last.position_rad, some_poses()[1][i], 1e-9);
  }
  run_for(2);
  EXPECT_FALSE(model_->state().light.shutter_open);
  EXPECT_TRUE(ended(1, JobEntry::State::aborted));
}

TEST_F(QueueTest, WithoutAParkPoseAnAbortedJobStops) {
  add_job(small_job(5));
  run_until([&] { return model_->state().motion && entry().done >= 2; });
  const std::size_t from = model_->history().size();
  EXPECT_EQ(ask(abort_job(1)).outcome(), protocol::DONE);
  EXPECT_EQ(actions<StopAxis>(from).size(), kAxisCount);
  run_for(20);
  EXPECT_TRUE(actions<MoveAxis>(from).empty());
}

TEST_F(QueueTest, AfterAnAbandonedPoseTheNextIsTaken) {
  machine::JobConfig job = small_job(3);
  job.retry = {2, 1};
  add_job(job);
  run_until([&] { return entry().done == 1; });
  model_->faults.off_target = 1;
  run_until([&] { return entry().abandoned == 1; });
  model_->faults.off_target = 0;
  run_to_completion();
  EXPECT_EQ(entry().done, 2);
  EXPECT_EQ(entry().abandoned, 1);
}

TEST_F(QueueTest, RetriesWaitLongerEachTime) {
  machine::JobConfig job = small_job(1);
  job.retry = {4, 10};
  add_job(job);
  model_->faults.off_target = 1;
  run_until([&] { return entry().abandoned == 1; });
  std::vector<base::Time> failed;
  std::vector<base::Time> started;
  for (const auto& event : model_->events()) {
    const base::Time at{std::chrono::microseconds(event.time_us())};
    if (event.has_pose_failed()) failed.push_back(at);
    if (event.has_pose_started()) started.push_back(at);
  }
  ASSERT_EQ(started.size(), 4U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(base::to_seconds(started[i + 1] - failed[i]), 10.0 * static_cast<double>(1U << i), 0.1);
  }
}

}  // namespace
}  // namespace rig::daemon::testing
