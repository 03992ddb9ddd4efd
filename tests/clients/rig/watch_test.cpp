// What a watcher is told, and how the watching ends.
#include "clients/rig/watch.h"

#include <algorithm>
#include <array>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include "core/base/interrupt.h"
#include "tests/clients/rig/fake_rigd.h"
#include "tests/core/temporary_folder.h"

namespace rig::client {
namespace {

using base::ErrorCode;
using base::Result;
using protocol::Event;
using protocol::JobInfo;
using protocol::Reply;
using protocol::Request;
using testing::HasSubstr;
using testing::Not;

Event job_changed(const JobInfo& job) {
  Event event;
  *event.mutable_job_changed()->mutable_job() = job;
  return event;
}

Event pose_started(std::int64_t row, const std::vector<double>& target_deg) {
  Event event;
  event.mutable_pose_started()->set_job(7);
  event.mutable_pose_started()->set_row(row);
  for (const double angle : target_deg) event.mutable_pose_started()->add_target_deg(angle);
  return event;
}

Event pose_committed(std::int64_t done) {
  Event event;
  event.mutable_pose_committed()->set_job(7);
  event.mutable_pose_committed()->set_done(done);
  event.mutable_pose_committed()->set_poses(4);
  return event;
}

Event pose_failed(std::int64_t row, std::uint32_t attempt, bool abandoned, const std::string& reason) {
  Event event;
  event.mutable_pose_failed()->set_row(row);
  event.mutable_pose_failed()->set_attempt(attempt);
  event.mutable_pose_failed()->set_abandoned(abandoned);
  event.mutable_pose_failed()->set_reason(reason);
  return event;
}

// A rig with one job, whose events follow the first answer about its jobs. The last of them is that the job
// has ended. A watcher looks at the jobs once at the beginning and once after each changed job, so that the
// look after the last one finds what became of it.
class Story {
 public:
  Story(JobInfo first, std::vector<Event> events, JobInfo last)
      : first_(std::move(first)), last_(std::move(last)), events_(std::move(events)) {
    events_.push_back(job_changed(last_));
    looks_left_ =
        std::count_if(events_.begin(), events_.end(), [](const Event& e) { return e.has_job_changed(); });
  }

  std::optional<Reply> operator()(const Request& request, test::FakeRigd& rigd) {
    Reply reply = test::outcome(protocol::DONE);
    if (request.has_get_status()) {
      *reply.mutable_status() = status;
    } else if (request.has_list_jobs()) {
      if (!told_) {
        for (const Event& event : events_) rigd.then(event);
      }
      told_ = true;
      const JobInfo& job = looks_left_-- > 0 ? first_ : last_;
      if (job.job() != 0) *reply.mutable_jobs()->add_jobs() = job;
    }
    return reply;
  }

  protocol::Status status = [] {
    protocol::Status running;
    running.set_epoch(1);
    running.set_mode(protocol::RUNNING);
    return running;
  }();

 private:
  JobInfo first_, last_;
  std::vector<Event> events_;
  std::ptrdiff_t looks_left_ = 0;
  bool told_ = false;
};

class Watching : public testing::Test {
 protected:
  // The lines of a watch of `story` until the rig is idle.
  std::string lines(Story story) {
    const test::FakeRigd rigd(folder_ / "run", std::move(story));
    testing::internal::CaptureStdout();
    result_ = watch({rigd.endpoint(), true});
    return testing::internal::GetCapturedStdout();
  }

  // The same on a terminal, where the line of progress is written again and again.
  std::string on_terminal(Story story, bool whole_screen = false) {
    const test::FakeRigd rigd(folder_ / "run", std::move(story));
    int master = -1;
    int slave = -1;
    const winsize size{24, 120, 0, 0};
    EXPECT_EQ(::openpty(&master, &slave, nullptr, nullptr, &size), 0);
    std::fflush(stdout);
    const int before = ::dup(STDOUT_FILENO);
    ::dup2(slave, STDOUT_FILENO);
    result_ = watch({rigd.endpoint(), true, !whole_screen});
    std::fflush(stdout);
    ::dup2(before, STDOUT_FILENO);
    ::close(before);
    ::close(slave);
    std::string text;
    std::array<char, 512> part{};
    for (ssize_t n = 0; (n = ::read(master, part.data(), part.size())) > 0;)
      text.append(part.data(), static_cast<std::size_t>(n));
    ::close(master);
    return text;
  }

  test::TemporaryFolder folder_;
  Result<void> result_;
};

TEST_F(Watching, TellsWhatHappens) {
  Event latched;
  latched.mutable_stop_latched()->set_reason("door");
  Event cleared;
  cleared.mutable_stop_cleared();
  Event alarm;
  alarm.mutable_alarm()->set_text("the light drifts");
  Event unknown;
  unknown.mutable_frame_taken();
  const std::string out = lines({test::job_of(7, protocol::ACTIVE, 1),
                                 {pose_failed(3, 1, false, "shaken"), latched, cleared, alarm, unknown,
                                  pose_failed(3, 5, true, "again")},
                                 test::job_of(7, protocol::COMPLETE, 4)});
  EXPECT_TRUE(result_.has_value());
  EXPECT_EQ(out,
            "job 7 'night': 1/4 poses, time left not known yet; \n"
            "row 3: attempt 1 failed: shaken\n"
            "stopped: door; `rig clear` lets the job go on\n"
            "the stop was cleared\n"
            "alarm: the light drifts\n"
            "row 3: attempt 5 failed, abandoned: again\n"
            "job 7 'night' (cloth): complete, 4/4 poses, /scans/1\n");
}

TEST_F(Watching, ShowsProgressOnATerminal) {
  const std::string out = on_terminal({test::job_of(7, protocol::ACTIVE, 1),
                                       {pose_started(12, {-1, 2.25, 30, 95}), pose_committed(2)},
                                       test::job_of(7, protocol::COMPLETE, 4)});
  EXPECT_TRUE(result_.has_value());
  EXPECT_THAT(
      out,
      HasSubstr(
          "\r\033[Kjob 7 'night': 1/4 poses, time left not known yet; row 12 at -1.0 2.2 30.0 95.0 deg"));
  EXPECT_THAT(out, testing::ContainsRegex("2/4 poses, [0-9:]+ left; row 12"));
  EXPECT_THAT(out, HasSubstr("\r\033[Kjob 7 'night' (cloth): complete"));
}

TEST_F(Watching, AWholeScreenIsGivenBackWithTheMessagesBelow) {
  ASSERT_EQ(::setenv("TERM", "xterm", 1), 0);
  const std::string out = on_terminal({test::job_of(7, protocol::ACTIVE, 1),
                                       {pose_failed(3, 1, false, "shaken")},
                                       test::job_of(7, protocol::COMPLETE, 4)},
                                      true);
  EXPECT_TRUE(result_.has_value());
  EXPECT_EQ(out.find("\033[?1049h"), 0U);
  EXPECT_THAT(out, HasSubstr("complete, 4/4 poses"));
  const std::string after = out.substr(out.find("\033[?1049l"));
  EXPECT_THAT(after, HasSubstr("row 3: attempt 1 failed: shaken"));
  EXPECT_THAT(after, HasSubstr("job 7 'night' (cloth): complete"));
}

TEST_F(Watching, AQueuedJobDoesNotHideTheOneThatRuns) {
  const std::string out = on_terminal({test::job_of(7, protocol::ACTIVE, 1),
                                       {job_changed(test::job_of(8, protocol::QUEUED)), pose_committed(3)},
                                       test::job_of(7, protocol::COMPLETE, 4)});
  EXPECT_THAT(out, HasSubstr("job 8 'night' (cloth): queued"));
  EXPECT_THAT(out, HasSubstr("job 7 'night': 3/4 poses"));
}

TEST_F(Watching, AJobThatIsHeldInTheMiddleIsShownWithItsReason) {
  JobInfo held = test::job_of(7, protocol::HELD, 1);
  auto& suspension = *held.add_suspensions();
  suspension.set_condition("held");
  suspension.set_reason("by hand");
  suspension.set_suspended_s(65);
  suspension.set_limit_s(600);
  const std::string out = lines({held, {}, test::job_of(7, protocol::COMPLETE, 4)});
  EXPECT_THAT(out,
              HasSubstr("job 7 'night': 1/4 poses, suspended; held for 1:05 of at most 10:00: by hand\n"));
  // One that waits in the queue is not the rig's.
  EXPECT_THAT(lines({test::job_of(7, protocol::HELD, 0), {}, test::job_of(7, protocol::COMPLETE, 4)}),
              Not(HasSubstr("0/4 poses, suspended")));
}

TEST_F(Watching, SurvivesEventsWithoutTheirContents) {
  Event bare_job, bare_pose;
  bare_job.mutable_job_changed();
  bare_pose.mutable_pose_committed();
  const std::string out = lines({test::job_of(7, protocol::ACTIVE, 1),
                                 {pose_started(3, {}), pose_started(3, {1}), Event{}, bare_job, bare_pose},
                                 test::job_of(7, protocol::COMPLETE, 4)});
  EXPECT_TRUE(result_.has_value());
  EXPECT_THAT(out, HasSubstr("complete, 4/4"));
}

TEST_F(Watching, OfAnIdleRigEndsAtOnce) {
  const std::string out = lines({JobInfo{}, {}, JobInfo{}});
  EXPECT_TRUE(result_.has_value());
  EXPECT_EQ(out, "");
}

TEST_F(Watching, SaysThatTheRigStandsStill) {
  Story story({JobInfo{}, {}, JobInfo{}});
  story.status.set_mode(protocol::STOPPED);
  story.status.set_stop_reason("emergency stop");
  EXPECT_EQ(lines(story), "stopped: emergency stop; `rig clear` lets the job go on\n");
}

TEST_F(Watching, AJobThatFailedIsAnError) {
  for (const auto state : {protocol::JOB_FAILED, protocol::ABORTED}) {
    const std::string out =
        lines({test::job_of(7, protocol::ACTIVE, 1), {}, test::job_of(7, state, 1, "the disk is full")});
    ASSERT_FALSE(result_.has_value());
    EXPECT_EQ(result_.error().text(), "job 7 'night': the disk is full");
    EXPECT_THAT(out, HasSubstr("1/4 poses: the disk is full, /scans/1\n"));
  }
}

TEST_F(Watching, AJobThatFailedBeforeItIsSilent) {
  (void)lines({test::job_of(7, protocol::JOB_FAILED, 1, "yesterday"), {}, JobInfo{}});
  EXPECT_TRUE(result_.has_value());
}

TEST_F(Watching, AJobThatCameAndFailedBetweenTwoLooksIsAnError) {
  // The list knows job 7 only; job 9 comes and fails before the next look at it.
  bool second = false;
  const auto answer = [&second](const Request& request, test::FakeRigd& rigd) -> std::optional<Reply> {
    Reply reply = test::outcome(protocol::DONE);
    if (request.has_get_status()) reply.mutable_status()->set_epoch(1);
    if (!request.has_list_jobs()) return reply;
    *reply.mutable_jobs()->add_jobs() = test::job_of(7, second ? protocol::COMPLETE : protocol::ACTIVE, 4);
    if (second) *reply.mutable_jobs()->add_jobs() = test::job_of(9, protocol::JOB_FAILED, 0, "no light");
    if (!second) rigd.then(job_changed(test::job_of(9, protocol::QUEUED)));
    second = true;
    return reply;
  };
  const test::FakeRigd rigd(folder_ / "run", answer);
  testing::internal::CaptureStdout();
  const auto result = watch({rigd.endpoint(), true});
  (void)testing::internal::GetCapturedStdout();
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().text(), "job 9 'night': no light");
}

TEST_F(Watching, ARefusalIsNoIdleRig) {
  for (const auto refused : {Request::kSubscribe, Request::kGetStatus, Request::kListJobs}) {
    const test::FakeRigd rigd(folder_ / "run", [refused](const Request& request, test::FakeRigd&) {
      return request.command_case() == refused ? test::outcome(protocol::REFUSED, "another version")
                                               : test::outcome(protocol::DONE);
    });
    const auto result = watch({rigd.endpoint(), true});
    ASSERT_FALSE(result.has_value()) << refused;
    EXPECT_EQ(result.error().code, ErrorCode::refused);
    EXPECT_EQ(result.error().text(), "refused: another version");
  }
}

TEST_F(Watching, RefusesWhatIsNoEndpoint) {
  const auto result = watch({"nonsense", true});
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::bad_input);
}

TEST_F(Watching, InterruptedLeavesRigdAlone) {
  EXPECT_EQ(test::in_child([this] {
              base::catch_interrupts();
              const test::FakeRigd rigd(folder_ / "run", [](const Request& request, test::FakeRigd&) {
                if (request.has_list_jobs()) ::kill(::getpid(), SIGINT);
                return test::outcome(protocol::DONE);
              });
              const auto result = watch({rigd.endpoint(), false});
              return !result && result.error().code == ErrorCode::interrupted ? 0 : 1;
            }),
            0);
}

TEST_F(Watching, GoesOnWhereItWasWhenRigdIsStartedAgain) {
  std::promise<void> promise;
  auto followed = promise.get_future();
  int lists = 0;
  const auto before = [&](const Request& request, test::FakeRigd& rigd) -> std::optional<Reply> {
    Reply reply = test::outcome(protocol::DONE);
    if (request.has_get_status()) reply.mutable_status()->set_epoch(1);
    if (!request.has_list_jobs()) return reply;
    *reply.mutable_jobs()->add_jobs() = test::job_of(7, protocol::ACTIVE, 1);
    // A changed job is looked at again: then the two events have arrived.
    if (++lists == 2) promise.set_value();
    rigd.then(pose_failed(1, 1, false, "shaken"));
    if (lists == 1) rigd.then(job_changed(test::job_of(7, protocol::ACTIVE, 1)));
    return reply;
  };
  const auto after = [](const Request& request, test::FakeRigd&) -> std::optional<Reply> {
    Reply reply = test::outcome(protocol::DONE);
    if (request.has_subscribe() && request.subscribe().epoch() == 1) {
      Event missed = pose_failed(2, 1, true, "while nobody watched");
      missed.set_epoch(2);
      missed.set_number(1);
      *reply.mutable_catch_up()->add_missed() = missed;
    }
    if (request.has_get_status()) reply.mutable_status()->set_epoch(2);
    if (request.has_list_jobs()) *reply.mutable_jobs()->add_jobs() = test::job_of(7, protocol::COMPLETE, 3);
    return reply;
  };
  auto rigd = std::make_unique<test::FakeRigd>(folder_ / "run", before);
  const std::string endpoint = rigd->endpoint();
  testing::internal::CaptureStdout();
  auto watching = std::async(std::launch::async, [&] { return watch({endpoint, true}); });
  followed.wait();
  rigd.reset();
  rigd = std::make_unique<test::FakeRigd>(folder_ / "run", after);
  const auto result = watching.get();
  const std::string out = testing::internal::GetCapturedStdout();
  EXPECT_TRUE(result.has_value());
  EXPECT_THAT(out, HasSubstr("row 2: attempt 1 failed, abandoned: while nobody watched\n"));
  const auto requests = rigd->requests();
  const auto subscribed =
      std::find_if(requests.begin(), requests.end(), [](const Request& r) { return r.has_subscribe(); });
  ASSERT_NE(subscribed, requests.end());
  EXPECT_EQ(subscribed->subscribe().epoch(), 1U);
  EXPECT_GE(subscribed->subscribe().after(), 2U);
}

}  // namespace
}  // namespace rig::client
