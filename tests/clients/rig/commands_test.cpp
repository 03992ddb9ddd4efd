// What each command sends, and what it says to every kind of answer.
#include "clients/rig/commands.h"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/clients/rig/fake_rigd.h"
#include "tests/core/temporary_folder.h"

// Last: it defines macros that hide the byte swaps of the system, which Protocol Buffers uses.
#include <OpenImageIO/imageio.h>

namespace rig::client {
namespace {

using base::ErrorCode;
using protocol::Reply;
using protocol::Request;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kJob = R"(format = 1
name = "first"
sample = "cloth"

[exposure]
strategy = "fixed"
exposures_us = [20000]

[poses]
angles_deg = [[0, 10, -20.5, 45]]
)";

class Commands : public testing::Test {
 protected:
  // Every command against a rig that gives this answer.
  std::vector<std::pair<std::string, Result<void>>> all() const {
    test::put_bytes(folder_ / "job.toml", kJob);
    return {{"status", status(to_)},
            {"home", home(to_, {})},
            {"move", move(to_, {{"pan", 3}})},
            {"stop", stop(to_, "")},
            {"clear", clear(to_)},
            {"light", light(to_, {})},
            {"snap", snap(to_, 100, folder_ / "a.png")},
            {"submit", job_submit(to_, folder_ / "job.toml", "scan")},
            {"list", job_list(to_)},
            {"show", job_show(to_, 1)},
            {"abort", job_abort(to_, 1)}};
  }

  test::TemporaryFolder folder_;
  Reply answer_ = test::outcome(protocol::DONE);
  test::FakeRigd rigd_{folder_ / "run", [this](const Request&, test::FakeRigd&) { return answer_; }};
  Connection to_{rigd_.endpoint(), 60};
};

TEST_F(Commands, SendWhatTheyWereTold) {
  ASSERT_TRUE(home(to_, {"roll", "arm"}).has_value());
  ASSERT_TRUE(home(to_, {}).has_value());
  ASSERT_TRUE(move(to_, {{"tilt", -12.5}, {"pan", 7}}).has_value());
  ASSERT_TRUE(stop(to_, "smoke").has_value());
  ASSERT_TRUE(clear(to_).has_value());
  ASSERT_TRUE(light(to_, {true, std::nullopt, 0.25}).has_value());
  ASSERT_TRUE(light(to_, {std::nullopt, false, std::nullopt}).has_value());
  ASSERT_TRUE(job_abort(to_, 42).has_value());
  const auto sent = rigd_.requests();
  ASSERT_EQ(sent.size(), 8U);
  EXPECT_THAT(sent[0].home().axes(), ElementsAre("roll", "arm"));
  EXPECT_TRUE(sent[1].has_home());
  EXPECT_THAT(sent[1].home().axes(), IsEmpty());
  ASSERT_EQ(sent[2].move().axes_size(), 2);
  EXPECT_EQ(sent[2].move().axes(0).axis(), "pan");
  EXPECT_EQ(sent[2].move().axes(0).angle_deg(), 7);
  EXPECT_EQ(sent[2].move().axes(1).angle_deg(), -12.5);
  EXPECT_EQ(sent[3].stop().reason(), "smoke");
  EXPECT_TRUE(sent[4].has_clear_stop());
  EXPECT_TRUE(sent[5].set_light().on());
  EXPECT_FALSE(sent[5].set_light().has_shutter_open());
  EXPECT_EQ(sent[5].set_light().level(), 0.25);
  EXPECT_FALSE(sent[6].set_light().has_on());
  EXPECT_TRUE(sent[6].set_light().has_shutter_open());
  EXPECT_FALSE(sent[6].set_light().shutter_open());
  EXPECT_EQ(sent[7].abort_job().job(), 42U);
}

TEST_F(Commands, SayWhyTheyWereRefused) {
  answer_ = test::outcome(protocol::REFUSED, "the axis pan is not homed");
  for (const auto& [name, result] : all()) {
    ASSERT_FALSE(result.has_value()) << name;
    EXPECT_EQ(result.error().code, ErrorCode::refused) << name;
    EXPECT_EQ(result.error().text(), "refused: the axis pan is not homed") << name;
  }
}

TEST_F(Commands, SayWhyTheyFailed) {
  answer_ = test::outcome(protocol::FAILED, "the drive does not answer");
  for (const auto& [name, result] : all()) {
    ASSERT_FALSE(result.has_value()) << name;
    EXPECT_EQ(result.error().code, ErrorCode::device) << name;
    EXPECT_EQ(result.error().text(), "failed: the drive does not answer") << name;
  }
}

TEST_F(Commands, GiveUpOnASilentRig) {
  const test::FakeRigd silent(folder_ / "silent",
                              [](const Request&, test::FakeRigd&) { return std::nullopt; });
  for (const std::string& endpoint : {silent.endpoint(), "ipc://" + (folder_ / "nobody.sock").string()}) {
    const auto result = status({endpoint, 0.05});
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().code, ErrorCode::timeout);
    EXPECT_EQ(result.error().where, endpoint);
    EXPECT_THAT(result.error().text(), HasSubstr("no answer from rigd within 0.05 s (is rigd running?"));
  }
}

TEST_F(Commands, RefuseWhatIsNoEndpoint) {
  const auto result = status({"nonsense", 60});
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::bad_input);
  EXPECT_THAT(result.error().text(), HasSubstr("nonsense: cannot connect"));
}

TEST_F(Commands, RefuseToWaitForNoTime) {
  for (const double wait_s : {std::nan(""), -1.0, 1e300, HUGE_VAL}) {
    const auto result = status({rigd_.endpoint(), wait_s});
    ASSERT_FALSE(result.has_value()) << wait_s;
    EXPECT_EQ(result.error().code, ErrorCode::bad_input) << wait_s;
  }
  EXPECT_EQ(snap(to_, std::nan(""), folder_ / "a.png").error().code, ErrorCode::bad_input);
  EXPECT_THAT(rigd_.requests(), IsEmpty());
}

TEST_F(Commands, PrintStatusAndJobs) {
  answer_.mutable_status()->set_rig_name("bench");
  answer_.mutable_status()->set_mode(protocol::IDLE);
  testing::internal::CaptureStdout();
  EXPECT_TRUE(status(to_).has_value());
  EXPECT_THAT(testing::internal::GetCapturedStdout(), testing::StartsWith("bench (rigd ): idle\n"));

  answer_ = test::outcome(protocol::DONE);
  *answer_.mutable_job() = test::job_of(3, protocol::QUEUED);
  testing::internal::CaptureStdout();
  EXPECT_TRUE(job_show(to_, 3).has_value());
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "job 3 'night' (cloth): queued, 0/4 poses, /scans/1\n");

  answer_ = test::outcome(protocol::DONE);
  testing::internal::CaptureStdout();
  EXPECT_TRUE(job_list(to_).has_value());
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "no jobs\n");
  *answer_.mutable_jobs()->add_jobs() = test::job_of(3, protocol::COMPLETE, 4);
  *answer_.mutable_jobs()->add_jobs() = test::job_of(4, protocol::ACTIVE, 1);
  testing::internal::CaptureStdout();
  EXPECT_TRUE(job_list(to_).has_value());
  EXPECT_EQ(testing::internal::GetCapturedStdout(),
            "job 3 'night' (cloth): complete, 4/4 poses, /scans/1\n"
            "job 4 'night' (cloth): active, 1/4 poses, /scans/1\n");
}

TEST_F(Commands, AJobWithMistakesIsNotSent) {
  const auto absent = job_submit(to_, folder_ / "job.toml", "scan");
  ASSERT_FALSE(absent.has_value());
  EXPECT_EQ(absent.error().code, ErrorCode::not_found);
  test::put_bytes(folder_ / "job.toml", std::string(kJob) + "speed = 1\n");
  const auto result = job_submit(to_, folder_ / "job.toml", "scan");
  ASSERT_FALSE(result.has_value());
  EXPECT_THAT(result.error().text(), HasSubstr("job.toml:11"));
  EXPECT_THAT(result.error().text(), HasSubstr("speed"));
  EXPECT_THAT(rigd_.requests(), IsEmpty());
}

TEST_F(Commands, AJobIsSentAsItIsWithAnAbsoluteFolder) {
  test::put_bytes(folder_ / "job.toml", kJob);
  ASSERT_TRUE(job_submit(to_, folder_ / "job.toml", "there/../scan").has_value());
  ASSERT_EQ(rigd_.requests().size(), 1U);
  const Request request = rigd_.requests()[0];
  EXPECT_EQ(request.submit_job().job_toml(), kJob);
  EXPECT_EQ(request.submit_job().job_name(), (folder_ / "job.toml").string());
  EXPECT_EQ(request.submit_job().scan_folder(), (std::filesystem::current_path() / "scan").string());
}

TEST_F(Commands, NoScanIsNotAGoodScan) {
  EXPECT_FALSE(scan_verify(folder_ / "absent").has_value());
  std::filesystem::create_directory(folder_ / "empty");
  EXPECT_FALSE(scan_verify(folder_ / "empty").has_value());
}

}  // namespace
}  // namespace rig::client
