// The widget's line at its worst.
#include "drivers/dmx_light/widget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/temporary_folder.h"
#include "tests/drivers/babble.h"

namespace rig::drivers::dmx_light {
namespace {

using base::ErrorCode;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

class RawWidget : public ::testing::Test {
 protected:
  std::unique_ptr<Widget> open(const RetryPolicy& policy) {
    SerialSettings line;
    line.path = (folder_ / "line").string();
    line.baud = 57600;
    auto widget = Widget::open(line, policy);
    EXPECT_TRUE(widget.has_value()) << widget.error().text();
    return std::move(*widget);
  }

  const test::TemporaryFolder folder_;
  sim::wire::Pty pty_{folder_ / "line"};
};

TEST_F(RawWidget, ALineThatNeverFallsSilentIsNotListenedToForEver) {
  const auto widget = open({2, milliseconds(100), milliseconds(800)});
  const test::Babble babble(pty_, std::string(512, 'x'), std::chrono::microseconds(1));
  const auto began = Steady::now();
  const auto told = widget->parameters();
  EXPECT_LT(Steady::now() - began, milliseconds(600));
  ASSERT_FALSE(told.has_value());
  EXPECT_EQ(told.error().code, ErrorCode::device);
  EXPECT_THAT(told.error().what, ::testing::HasSubstr("bytes and no answer of a widget"));
}

TEST_F(RawWidget, ACallThatIsOverAsksNothing) {
  const auto widget = open({3, milliseconds(100), milliseconds(800)});
  widget->begin_call(Steady::now());
  const auto put_out = widget->put_out(std::string(24, '\0'));
  ASSERT_FALSE(put_out.has_value());
  EXPECT_EQ(put_out.error().code, ErrorCode::lost);
  EXPECT_EQ(pty_.read(milliseconds(20)), "");
}

TEST_F(RawWidget, ASilentOneIsGivenUpWhenTheCallIsOver) {
  const auto widget = open({10, milliseconds(100), milliseconds(1000)});
  const auto began = Steady::now();
  widget->begin_call(began + milliseconds(250));
  const auto told = widget->parameters();
  EXPECT_LT(Steady::now() - began, milliseconds(500));
  ASSERT_FALSE(told.has_value());
  EXPECT_EQ(told.error().code, ErrorCode::lost);
  EXPECT_THAT(told.error().what, ::testing::HasSubstr("the call's time is over"));
}

}  // namespace
}  // namespace rig::drivers::dmx_light
