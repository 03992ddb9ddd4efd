#include "drivers/common/retry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

namespace rig::drivers {
namespace {

using base::ErrorCode;
using base::fail;
using base::Result;
using ::testing::HasSubstr;

// Answers one after the other as listed; `timeout` and so on are errors, `io` stands for success.
struct Answers {
  std::vector<ErrorCode> list;
  std::size_t asked = 0;
  Result<int> operator()() {
    const ErrorCode code = list.at(asked++);
    if (code == ErrorCode::io) return 7;
    return fail(code, "no luck", "/dev/x");
  }
};

constexpr RetryPolicy kThree{3, std::chrono::milliseconds(1)};

TEST(Retries, AreMadeUntilOneSucceeds) {
  Answers answers{{ErrorCode::timeout, ErrorCode::damaged, ErrorCode::io}};
  const auto answer = with_retries(kThree, [&] { return answers(); });
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(*answer, 7);
  EXPECT_EQ(answers.asked, 3U);
}

TEST(Retries, ADeviceThatNeverAnswersIsLost) {
  Answers answers{{ErrorCode::damaged, ErrorCode::timeout, ErrorCode::timeout}};
  const auto answer = with_retries(kThree, [&] { return answers(); });
  ASSERT_FALSE(answer.has_value());
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
  EXPECT_THAT(answer.error().what, HasSubstr("3 times"));
  EXPECT_EQ(answer.error().where, "/dev/x");
}

TEST(Retries, OneWhoseLastAnswerIsGarbledIsAFaultOfTheDevice) {
  Answers answers{{ErrorCode::timeout, ErrorCode::timeout, ErrorCode::damaged}};
  const auto answer = with_retries(kThree, [&] { return answers(); });
  ASSERT_FALSE(answer.has_value());
  EXPECT_EQ(answer.error().code, ErrorCode::device);
}

TEST(Retries, OtherErrorsAreHandedOnAtOnce) {
  for (const ErrorCode code : {ErrorCode::device, ErrorCode::lost, ErrorCode::refused}) {
    Answers answers{{code}};
    const auto answer = with_retries(kThree, [&] { return answers(); });
    ASSERT_FALSE(answer.has_value());
    EXPECT_EQ(answer.error().code, code);
    EXPECT_EQ(answer.error().what, "no luck");
    EXPECT_EQ(answers.asked, 1U);
  }
}

TEST(Retries, OneAttemptIsNotCalledSeveral) {
  Answers answers{{ErrorCode::timeout}};
  const auto answer = with_retries(RetryPolicy{1, std::chrono::milliseconds(1)}, [&] { return answers(); });
  ASSERT_FALSE(answer.has_value());
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
  EXPECT_EQ(answer.error().what, "no luck");
}

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

TEST(CallsTime, EachAttemptIsToldByWhenItsAnswerHasToBeThere) {
  const RetryPolicy policy{100000, milliseconds(100), milliseconds(1000)};
  const auto began = Steady::now();
  const Deadline ends = began + milliseconds(300);
  std::vector<Deadline> told;
  const auto answer = with_retries(policy, ends, "/dev/x", [&](Deadline answer_by) -> Result<int> {
    told.push_back(answer_by);
    std::this_thread::sleep_for(milliseconds(1));
    return fail(ErrorCode::timeout, "no luck", "/dev/x");
  });
  ASSERT_FALSE(answer.has_value());
  ASSERT_GT(told.size(), 1U);
  EXPECT_GE(told.front(), began + milliseconds(100));
  for (const Deadline answer_by : told) EXPECT_LE(answer_by, ends);
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
  EXPECT_THAT(answer.error().what, HasSubstr("no luck; the call's time is over"));
}

TEST(CallsTime, ACallThatIsOverAsksNothing) {
  const RetryPolicy policy{3, milliseconds(100), milliseconds(1000)};
  int asked = 0;
  const auto attempt = [&](Deadline) -> Result<int> { return ++asked; };
  for (const milliseconds left : {milliseconds(-5), milliseconds(0), milliseconds(20)}) {
    const auto answer = with_retries(policy, Steady::now() + left, "/dev/x", attempt);
    ASSERT_FALSE(answer.has_value());
    EXPECT_EQ(answer.error().code, ErrorCode::lost);
    EXPECT_EQ(answer.error().where, "/dev/x");
    EXPECT_THAT(answer.error().hint, HasSubstr("call_ms"));
  }
  EXPECT_EQ(asked, 0);
  // A stop is sent all the same.
  EXPECT_TRUE(with_retries(policy, policy.stop_ends(Steady::now() - milliseconds(5)), "/dev/x", attempt));
  EXPECT_EQ(asked, 1);
}

TEST(CallsTime, AGarbledAnswerOfACallThatIsOverIsLost) {
  const RetryPolicy policy{3, milliseconds(40), milliseconds(1000)};
  const Deadline ends = Steady::now() + milliseconds(45);
  const auto answer = with_retries(policy, ends, "/dev/x", [&](Deadline answer_by) -> Result<int> {
    std::this_thread::sleep_until(answer_by);
    return fail(ErrorCode::damaged, "noise", "/dev/x");
  });
  ASSERT_FALSE(answer.has_value());
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
}

}  // namespace
}  // namespace rig::drivers
