#include "drivers/common/reply_stream.h"

#include <atomic>
#include <gtest/gtest.h>
#include <thread>

#include "sim/wire/pty.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers {
namespace {

using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

// Lines that end with ';'.
class Lines {
 public:
  void feed(std::string_view bytes) { rest_ += bytes; }
  std::optional<std::string> next() {
    const auto end = rest_.find(';');
    if (end == std::string::npos) return std::nullopt;
    std::string line = rest_.substr(0, end);
    rest_.erase(0, end + 1);
    return line;
  }

 private:
  std::string rest_;
};

class ReplyStreamTest : public ::testing::Test {
 protected:
  ReplyStreamTest() : stream_(std::move(*SerialLine::open({pty_.path().string(), 9600, 'N', 1}))) {}

  static Steady::time_point within(int ms) { return Steady::now() + milliseconds(ms); }

  test::TemporaryFolder folder_;
  sim::wire::Pty pty_{folder_ / "line"};
  ReplyStream<Lines> stream_;
};

TEST_F(ReplyStreamTest, HandsOutOneReplyAfterTheOther) {
  pty_.write("a;b;c");
  EXPECT_EQ(**stream_.next(within(5000)), "a");
  EXPECT_EQ(**stream_.next(within(0)), "b");
  EXPECT_FALSE(stream_.next(within(20))->has_value());
  pty_.write("d;");
  EXPECT_EQ(**stream_.next(within(5000)), "cd");
}

TEST_F(ReplyStreamTest, WritesWhatItIsGiven) {
  ASSERT_TRUE(stream_.write("hello", milliseconds(100)).has_value());
  EXPECT_EQ(pty_.read(milliseconds(5000)), "hello");
}

TEST_F(ReplyStreamTest, ALineThatNeverFallsSilentEndsAtItsDeadline) {
  std::atomic<bool> enough = false;
  std::thread babble([&] {
    while (!enough) pty_.write(std::string(500, 'x'));
  });
  const auto began = Steady::now();
  const auto reply = stream_.next(within(50));
  EXPECT_LT(Steady::now() - began, std::chrono::seconds(20));
  ASSERT_TRUE(reply.has_value());
  EXPECT_FALSE(reply->has_value());
  enough = true;
  babble.join();
}

TEST_F(ReplyStreamTest, SaysThatTheLineIsLost) {
  pty_.cut();
  EXPECT_EQ(stream_.next(within(5000)).error().code, base::ErrorCode::lost);
}

}  // namespace
}  // namespace rig::drivers
