#include "drivers/common/steps.h"

#include <gtest/gtest.h>
#include <string>
#include <thread>

namespace rig::drivers {
namespace {

using base::ErrorCode;
using base::fail;
using std::chrono::milliseconds;
using Is = Steps::Is;

constexpr milliseconds kAmple{10000};

TEST(Steps, AreDoneInTheirOrder) {
  Steps steps;
  std::string done;
  for (const char name : {'a', 'b', 'c'}) {
    steps.add([&done, name]() -> base::Result<Is> {
      done += name;
      return Is::done;
    });
  }
  EXPECT_FALSE(steps.empty());
  EXPECT_TRUE(*steps.advance(kAmple));
  EXPECT_EQ(done, "abc");
  EXPECT_TRUE(steps.empty());
  EXPECT_TRUE(*steps.advance(kAmple));
}

TEST(Steps, WaitForOneThatIsNotDone) {
  Steps steps;
  int asked = 0;
  bool after = false;
  steps.add([&]() -> base::Result<Is> { return ++asked < 3 ? Is::waiting : Is::done; });
  steps.add([&]() -> base::Result<Is> {
    after = true;
    return Is::done;
  });
  EXPECT_FALSE(*steps.advance(kAmple));
  EXPECT_FALSE(*steps.advance(kAmple));
  EXPECT_FALSE(after);
  EXPECT_TRUE(*steps.advance(kAmple));
  EXPECT_EQ(asked, 3);
  EXPECT_TRUE(after);
}

TEST(Steps, AnErrorEndsThem) {
  Steps steps;
  bool after = false;
  steps.add([]() -> base::Result<Is> { return fail(ErrorCode::device, "no"); });
  steps.add([&]() -> base::Result<Is> {
    after = true;
    return Is::done;
  });
  EXPECT_EQ(steps.advance(kAmple).error().code, ErrorCode::device);
  EXPECT_TRUE(steps.empty());
  EXPECT_TRUE(*steps.advance(kAmple));
  EXPECT_FALSE(after);
}

TEST(Steps, ShareACallsTime) {
  Steps steps;
  int done = 0;
  for (int i = 0; i < 3; ++i) {
    steps.add([&]() -> base::Result<Is> {
      ++done;
      return Is::done;
    });
  }
  // No time at all is enough for one.
  EXPECT_FALSE(*steps.advance(milliseconds(0)));
  EXPECT_EQ(done, 1);
  EXPECT_FALSE(*steps.advance(milliseconds(0)));
  EXPECT_TRUE(*steps.advance(milliseconds(0)));
  EXPECT_EQ(done, 3);
}

TEST(Steps, MayAddFurtherOnes) {
  Steps steps;
  std::string done;
  steps.add([&]() -> base::Result<Is> {
    done += 'a';
    steps.add([&]() -> base::Result<Is> {
      done += 'c';
      return Is::done;
    });
    return Is::done;
  });
  steps.add([&]() -> base::Result<Is> {
    done += 'b';
    return Is::done;
  });
  EXPECT_TRUE(*steps.advance(kAmple));
  EXPECT_EQ(done, "abc");
}

}  // namespace
}  // namespace rig::drivers
