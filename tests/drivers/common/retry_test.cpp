#include "drivers/common/retry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
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

}  // namespace
}  // namespace rig::drivers
