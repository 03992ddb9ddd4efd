// What suspends a job, what releases it, and what happens when it takes too long.
#include "daemon/conditions.h"

#include "daemon/space.h"
#include "tests/daemon/job_fixture.h"

namespace rig::daemon::testing {
namespace {

using base::seconds;
using Strings = std::vector<std::string>;

class ConditionsTest : public JobTest {
 protected:
  void run_to_third_pose(const machine::JobConfig& job = small_job(5)) {
    add_job(job);
    run_until([&] { return entry().done >= 2 && model_->state().frame; });
  }
};

TEST_F(ConditionsTest, AnUndisturbedJobIsNeverSuspended) {
  add_job(small_job(5));
  run_to_completion();
  EXPECT_EQ(suspensions(), Strings{});
}

TEST_F(ConditionsTest, ADimLampSuspendsAtOnceAndReleasesWithHysteresis) {
  run_to_third_pose();
  double level = 0.9;
  model_->on_light_read = [&level](drivers::LightState& light) { light.level *= level; };
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+light"});
  EXPECT_EQ(show(1).state(), protocol::SUSPENDED);
  ASSERT_EQ(show(1).suspensions_size(), 1);
  EXPECT_NE(show(1).suspensions(0).reason().find("level 0.900"), std::string::npos);
  level = 0.96;  // within the band of 0.05, not within half of it
  run_for(30);
  EXPECT_TRUE(resting());
  level = 1;
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+light", "-light"}));
  EXPECT_EQ(entry().done, 5);
  EXPECT_EQ(entry().retries, 0);  // the pose that was given back cost no attempt
}

TEST_F(ConditionsTest, NoExposureBeginsWhileSuspendedAndTheShutterIsShut) {
  run_to_third_pose();
  model_->on_light_read = [](drivers::LightState& light) { light.warm = false; };
  run_until([&] { return resting(); });
  const std::size_t from = model_->history().size();
  run_for(60);
  EXPECT_TRUE(actions<TriggerCamera>(from).empty());
  EXPECT_TRUE(actions<MoveAxis>(from).empty());
  EXPECT_FALSE(model_->state().light.shutter_open);
}

TEST_F(ConditionsTest, ALampThatNeverGetsWarmSuspends) {
  model_->on_light_read = [](drivers::LightState& light) { light.warm = false; };
  add_job(small_job(2));
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+light"});
  EXPECT_NE(model_->state().conditions[static_cast<std::size_t>(Condition::light)].reason.find("100 s"),
            std::string::npos);
  model_->on_light_read = nullptr;
  run_to_completion();
}

TEST_F(ConditionsTest, AShortDiskSuspendsAfterThePose) {
  add_job(small_job(5));
  run_until([&] { return entry().done >= 1 && model_->state().frame; });
  const std::int64_t row = model_->state().frame->row;
  model_->post(DiskRead{1e6});
  model_->free_bytes = 1e6;
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+disk"});
  EXPECT_EQ(model_->plan(1).at(static_cast<std::size_t>(row)).state, scan::RowState::done);
  // What the rest needs and the margin, but not the quarter of the margin more that releases it.
  model_->free_bytes = bytes_left_to_write(setup_, model_->state()) + 1.1 * 500e6;
  run_for(20);
  EXPECT_TRUE(resting());
  model_->free_bytes = 1e12;
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+disk", "-disk"}));
  EXPECT_EQ(entry().done, 5);
}

TEST_F(ConditionsTest, ADiskThatRefusesSuspendsUntilItTakesFilesAgain) {
  run_to_third_pose();
  model_->disk_refuses = true;
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+disk"});
  EXPECT_EQ(model_->state().stopped, "");
  EXPECT_EQ(show(1).state(), protocol::SUSPENDED);
  EXPECT_NE(show(1).suspensions(0).reason().find("the scan's disk: no space left"), std::string::npos);
  const std::size_t from = model_->history().size();
  run_for(60);
  EXPECT_TRUE(resting());
  EXPECT_EQ(suspensions(), Strings{"+disk"}) << "told once";
  const auto tries = actions<PollDisk>(from);
  EXPECT_NEAR(static_cast<double>(tries.size()), 12, 1);
  for (const PollDisk& tried : tries) EXPECT_TRUE(tried.write);
  EXPECT_TRUE(actions<OpenJob>(from).empty());
  model_->disk_refuses = false;
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+disk", "-disk"}));
  EXPECT_EQ(entry().done, 5);
  EXPECT_EQ(entry().retries, 0);
  // What rigd could not write for itself meanwhile is written now.
  EXPECT_FALSE(actions<SaveStop>(from).empty());
  EXPECT_FALSE(actions<SaveLease>(from).empty());
}

TEST_F(ConditionsTest, ADiskThatRefusesWhileTheStopIsLatchedIsNoFurtherReasonToClearOne) {
  run_to_third_pose();
  model_->disk_refuses = true;
  run_until([&] { return resting(); });
  protocol::Request stop;
  stop.mutable_stop()->set_reason("a hand in the rig");
  ask(stop);
  model_->disk_refuses = false;
  run_for(20);
  protocol::Request clear;
  clear.mutable_clear_stop();
  EXPECT_EQ(ask(clear).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(entry().done, 5);
}

// It takes files, and refuses those of the job: that no room mends.
TEST_F(ConditionsTest, ADiskThatRefusesAgainAndAgainLatchesTheStop) {
  run_to_third_pose();
  const auto done = entry().done;
  int refusals = 0;
  while (model_->state().stopped.empty() && refusals < 20) {
    run_until([&] { return !model_->state().disk_refuses; });
    model_->post(StorageFailed{"permission denied", 0, true});
    ++refusals;
    run_until([&] { return model_->state().disk_refuses || !model_->state().stopped.empty(); });
  }
  EXPECT_EQ(refusals, 6);
  EXPECT_EQ(model_->state().stopped, "the scan's disk: permission denied");
  EXPECT_EQ(entry().done, done);
  // Damage is nothing that room mends either.
  restart();
  model_->post(StorageFailed{"the journal is damaged"});
  run_until([&] { return !model_->state().stopped.empty(); });
}

TEST_F(ConditionsTest, ADiskThatRefusesWithoutAJobIsAnAlarm) {
  model_->post(StorageFailed{"no space left", 0, true});
  run_for(1);
  EXPECT_EQ(model_->state().stopped, "");
  EXPECT_TRUE(std::any_of(model_->events().begin(), model_->events().end(), [](const protocol::Event& event) {
    return event.has_alarm() && event.alarm().text() == "the scan's disk: no space left";
  }));
  run_for(10);
  EXPECT_FALSE(model_->state().disk_refuses);
}

TEST_F(ConditionsTest, ACameraThatComesBackCostsNoAttemptAndNoStop) {
  run_to_third_pose();
  model_->gone.insert("camera");
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+device lost"});
  EXPECT_TRUE(model_->state().stopped.empty());
  run_for(20);
  EXPECT_TRUE(resting());
  protocol::Request snap;
  snap.mutable_snap()->set_exposure_us(1000);
  EXPECT_EQ(ask(snap).outcome(), protocol::REFUSED);
  model_->gone.clear();
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+device lost", "-device lost"}));
  EXPECT_EQ(entry().done, 5);
  EXPECT_EQ(entry().retries, 0);
}

TEST_F(ConditionsTest, AnAxisThatComesBackWithoutItsReferenceIsHomedFirst) {
  run_to_third_pose();
  model_->gone.insert("axis pan");
  run_until([&] { return resting(); });
  model_->lose_reference(2);
  model_->gone.clear();
  run_to_completion();
  ASSERT_EQ(actions<HomeAxis>().size(), 1U);
  EXPECT_EQ(actions<HomeAxis>()[0].axis, 2U);
  EXPECT_EQ(entry().done, 5);
}

TEST_F(ConditionsTest, AFaultThatIsNotTransientLatches) {
  run_to_third_pose();
  model_->post(DeviceFailed{"camera: burnt", "camera", false});
  run_until([&] { return !model_->state().stopped.empty(); });
  EXPECT_EQ(suspensions(), Strings{"+stopped"});
  EXPECT_EQ(show(1).state(), protocol::SUSPENDED);
  protocol::Request clear;
  clear.mutable_clear_stop();
  EXPECT_EQ(ask(clear).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+stopped", "-stopped"}));
}

TEST_F(ConditionsTest, TheEmergencyStopLatchesAndSuspends) {
  run_to_third_pose();
  model_->emergency_stop = true;
  run_until([&] { return !model_->state().stopped.empty(); });
  EXPECT_EQ(model_->state().stopped, "emergency stop");
  model_->emergency_stop = false;
  run_for(60);
  EXPECT_EQ(model_->state().stopped, "emergency stop");
  EXPECT_EQ(suspensions(), Strings{"+stopped"});
}

TEST_F(ConditionsTest, AHotLampSuspendsUntilItHasCooled) {
  setup_.rig.unattended.suspend.max_temperature_c = 80;
  restart();
  run_to_third_pose();
  double temperature = 81;
  model_->on_light_read = [&](drivers::LightState& light) { light.temperature_c = temperature; };
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+temperature"});
  temperature = 76;
  run_for(60);
  EXPECT_TRUE(resting());
  temperature = 74;
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+temperature", "-temperature"}));
}

TEST_F(ConditionsTest, AHotCameraSuspendsUntilItHasCooled) {
  setup_.rig.unattended.suspend.max_temperature_c = 60;
  restart();
  run_to_third_pose(small_job(60));  // the camera is asked every ten seconds
  model_->camera_temperature_c = 61;
  run_until([&] { return resting(); });
  EXPECT_EQ(suspensions(), Strings{"+temperature"});
  model_->camera_temperature_c = 54;
  run_to_completion();
  EXPECT_EQ(suspensions(), (Strings{"+temperature", "-temperature"}));
}

TEST_F(ConditionsTest, AfterTheLimitTheJobIsHeldForAPerson) {
  setup_.rig.unattended.suspend.limit_s = 100;
  restart();
  run_to_third_pose();
  model_->gone.insert("camera");
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_NE(entry().hold.find("more than 100 s: camera: unplugged"), std::string::npos) << entry().hold;
  model_->gone.clear();
  run_for(30);
  EXPECT_EQ(suspensions(), (Strings{"+device lost", "+held", "-device lost"}));
  EXPECT_EQ(show(1).state(), protocol::HELD);
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
}

TEST_F(ConditionsTest, AfterTheLimitTheJobFailsWhereTheRigSaysSo) {
  setup_.rig.unattended.suspend.limit_s = 100;
  setup_.rig.unattended.suspend.fail_at_limit = true;
  restart();
  run_to_third_pose();
  add_job(small_job(1), 2);
  model_->gone.insert("camera");
  run_until([&] { return ended(1, JobEntry::State::failed); });
  EXPECT_NE(entry().reason.find("more than 100 s"), std::string::npos) << entry().reason;
  model_->gone.clear();
  run_to_completion(2);
}

TEST_F(ConditionsTest, AStopThatNobodyClearsForLongEndsInAHold) {
  setup_.rig.unattended.suspend.limit_s = 10;  // is not for what waits for a person
  setup_.rig.unattended.suspend.person_limit_s = 100;
  setup_.rig.unattended.suspend.fail_at_limit = true;  // nor is failing for a stop
  restart();
  run_to_third_pose();
  model_->emergency_stop = true;
  run_until([&] { return !model_->state().stopped.empty(); });
  model_->emergency_stop = false;
  run_for(90);
  EXPECT_EQ(entry().hold, "");
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_EQ(entry().hold, "suspended for more than 100 s: emergency stop");
  protocol::Request clear;
  clear.mutable_clear_stop();
  EXPECT_EQ(ask(clear).outcome(), protocol::DONE);
  run_for(30);
  EXPECT_EQ(suspensions(), (Strings{"+stopped", "+held", "-stopped"}));
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
}

TEST_F(ConditionsTest, AHoldThatNobodyReleasesFailsWhereTheRigSaysSo) {
  setup_.rig.unattended.suspend.person_limit_s = 100;
  setup_.rig.unattended.suspend.fail_at_limit = true;
  restart();
  run_to_third_pose();
  add_job(small_job(1), 2);
  EXPECT_EQ(hold(1, "a look at the sample").outcome(), protocol::DONE);
  run_until([&] { return ended(1, JobEntry::State::failed); });
  EXPECT_EQ(entry().reason, "suspended for more than 100 s: a look at the sample");
  run_to_completion(2);
}

TEST_F(ConditionsTest, ASampleThatNobodyChangesIsAskedForOnceMore) {
  setup_.rig.unattended.suspend.person_limit_s = 100;
  restart();
  machine::JobConfig job = small_job(2);
  job.needs_sample_change = true;
  add_job(job);
  run_until([&] { return !suspensions().empty(); });
  EXPECT_EQ(occasions(), Strings{"suspended"});
  run_for(120);
  EXPECT_EQ(occasions(), (Strings{"suspended", "held"}));
  EXPECT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
}

TEST_F(ConditionsTest, AVanishedScanFolderFailsTheJobAndTheNextGoesOn) {
  run_to_third_pose();
  add_job(small_job(1), 2);
  model_->scan_folder_gone = true;
  run_until([&] { return ended(1, JobEntry::State::failed); });
  EXPECT_EQ(entry().reason, "the folder is gone");
  EXPECT_TRUE(model_->state().stopped.empty());
  model_->scan_folder_gone = false;
  run_to_completion(2);
}

}  // namespace
}  // namespace rig::daemon::testing
