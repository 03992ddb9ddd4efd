#include "drivers/common/serial_line.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <thread>
#include <unistd.h>

#include "sim/wire/pty.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers {
namespace {

using base::ErrorCode;
using sim::wire::Pty;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr milliseconds kSoon{20};
constexpr milliseconds kLong{5000};

class SerialLineTest : public ::testing::Test {
 protected:
  std::unique_ptr<SerialLine> open() {
    auto line = SerialLine::open({pty_.path().string(), 9600, 'N', 1});
    EXPECT_TRUE(line.has_value()) << line.error().text();
    return std::move(*line);
  }

  test::TemporaryFolder folder_;
  Pty pty_{folder_ / "line"};
};

TEST_F(SerialLineTest, BytesGoBothWaysUnchanged) {
  const auto line = open();
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all.push_back(static_cast<char>(byte));
  ASSERT_TRUE(line->write(all, kLong).has_value());
  std::string came;
  while (came.size() < all.size()) {
    const std::string more = pty_.read(kLong);
    ASSERT_FALSE(more.empty());
    came += more;
  }
  EXPECT_EQ(came, all);
  pty_.write(all);
  const auto back = line->read_exactly(all.size(), kLong);
  ASSERT_TRUE(back.has_value()) << back.error().text();
  EXPECT_EQ(*back, all);
}

TEST_F(SerialLineTest, ReadsUpToAnEnd) {
  const auto line = open();
  pty_.write("one\rtwo\rthr");
  EXPECT_EQ(*line->read_until('\r', kLong), "one");
  EXPECT_EQ(*line->read_until('\r', kLong), "two");
  const auto early = line->read_until('\r', kSoon);
  EXPECT_EQ(early.error().code, ErrorCode::timeout);
  pty_.write("ee\r");
  EXPECT_EQ(*line->read_until('\r', kLong), "three");
}

TEST_F(SerialLineTest, MoreThanItsMostWithoutAnEndIsDamaged) {
  const auto line = open();
  pty_.write(std::string(50, 'x'));
  const auto answer = line->read_until('\r', kLong, 40);
  EXPECT_EQ(answer.error().code, ErrorCode::damaged);
  pty_.write("fine\r");
  EXPECT_THAT(*line->read_until('\r', kLong, 40), HasSubstr("fine"));
}

TEST_F(SerialLineTest, TooFewBytesAreATimeOutAndStay) {
  const auto line = open();
  pty_.write("abc");
  EXPECT_EQ(line->read_exactly(4, kSoon).error().code, ErrorCode::timeout);
  pty_.write("d");
  EXPECT_EQ(*line->read_exactly(4, kLong), "abcd");
}

TEST_F(SerialLineTest, ReadsSomeAsSoonAsThereIsAnything) {
  const auto line = open();
  EXPECT_EQ(*line->read_some(Steady::now()), "");
  pty_.write("ab");
  EXPECT_EQ(*line->read_some(Steady::now() + kLong), "ab");
  EXPECT_EQ(*line->read_some(Steady::now() + kSoon), "");
  // What another reader has left counts too.
  pty_.write("one\rtwo");
  EXPECT_EQ(*line->read_until('\r', kLong), "one");
  EXPECT_EQ(*line->read_some(Steady::now() + kLong), "two");
}

TEST_F(SerialLineTest, ReadsWhatWaitsWithoutWaiting) {
  const auto line = open();
  EXPECT_EQ(*line->read_waiting(), "");
  pty_.write("abc");
  std::string came;
  while (came.size() < 3) came += *line->read_waiting();
  EXPECT_EQ(came, "abc");
}

TEST_F(SerialLineTest, DropsWhatNobodyRead) {
  const auto line = open();
  pty_.write("old\rhalf");
  EXPECT_EQ(*line->read_until('\r', kLong), "old");
  line->discard_input();
  pty_.write("new\r");
  EXPECT_EQ(*line->read_until('\r', kLong), "new");
}

TEST_F(SerialLineTest, IsOursAlone) {
  const auto line = open();
  const auto second = SerialLine::open({pty_.path().string(), 9600, 'N', 1});
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::busy);
}

TEST_F(SerialLineTest, IsFreeAgainAfterItsEnd) {
  for (int i = 0; i < 3; ++i) (void)open();
}

TEST_F(SerialLineTest, ALineThatIsNotThereIsLost) {
  const auto line = SerialLine::open({(folder_ / "nowhere").string(), 9600, 'N', 1});
  ASSERT_FALSE(line.has_value());
  EXPECT_EQ(line.error().code, ErrorCode::lost);
  EXPECT_THAT(line.error().text(), HasSubstr("plugged in"));
}

TEST_F(SerialLineTest, AFileIsNoLine) {
  test::put_bytes(folder_ / "file", "x");
  const auto line = SerialLine::open({(folder_ / "file").string(), 9600, 'N', 1});
  ASSERT_FALSE(line.has_value());
  EXPECT_THAT(line.error().text(), HasSubstr("no serial line"));
}

TEST_F(SerialLineTest, ASpeedThatThereIsNotIsRefused) {
  const auto line = SerialLine::open({pty_.path().string(), 12345, 'N', 1});
  ASSERT_FALSE(line.has_value());
  EXPECT_EQ(line.error().code, ErrorCode::bad_input);
}

TEST_F(SerialLineTest, SetsSpeedParityAndStopBits) {
  const auto line = SerialLine::open({pty_.path().string(), 38400, 'E', 2});
  ASSERT_TRUE(line.has_value());
  const int fd = ::open(pty_.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios mode{};
  ASSERT_EQ(::tcgetattr(fd, &mode), 0);
  ::close(fd);
  EXPECT_EQ(::cfgetospeed(&mode), static_cast<speed_t>(B38400));
  EXPECT_EQ(::cfgetispeed(&mode), static_cast<speed_t>(B38400));
  EXPECT_NE(mode.c_cflag & CSTOPB, 0U);
  EXPECT_EQ(mode.c_lflag & (ECHO | ICANON), 0U);
}

TEST_F(SerialLineTest, IsLostWhenItsPlugIsPulled) {
  const auto line = open();
  pty_.cut();
  EXPECT_EQ(line->read_some(Steady::now() + kLong).error().code, ErrorCode::lost);
  EXPECT_EQ(line->read_exactly(1, kLong).error().code, ErrorCode::lost);
  EXPECT_EQ(line->read_waiting().error().code, ErrorCode::lost);
  EXPECT_EQ(line->write("x", kLong).error().code, ErrorCode::lost);
}

TEST_F(SerialLineTest, IsLostWhileItWaits) {
  const auto line = open();
  std::thread plug([&] {
    std::this_thread::sleep_for(kSoon);
    pty_.cut();
  });
  const auto answer = line->read_until('\r', kLong);
  plug.join();
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
}

TEST_F(SerialLineTest, ComesBackUnderItsName) {
  {
    const auto line = open();
    pty_.cut();
    EXPECT_FALSE(SerialLine::open({pty_.path().string(), 9600, 'N', 1}).has_value());
    pty_.restore();
    // The old one stays lost.
    EXPECT_EQ(line->write("x", kLong).error().code, ErrorCode::lost);
  }
  const auto again = open();
  pty_.write("hello\r");
  EXPECT_EQ(*again->read_until('\r', kLong), "hello");
}

TEST_F(SerialLineTest, ALineThatTakesNothingIsATimeOut) {
  const auto line = open();
  // Nobody reads the other end: its buffer fills up.
  base::Result<void> wrote;
  for (int i = 0; i < 1000 && wrote; ++i) wrote = line->write(std::string(4096, 'x'), kSoon);
  ASSERT_FALSE(wrote.has_value());
  EXPECT_EQ(wrote.error().code, ErrorCode::timeout);
}

TEST(Pty, ReadsNothingWithoutADriver) {
  test::TemporaryFolder folder;
  Pty pty(folder / "line");
  EXPECT_EQ(pty.read(kSoon), "");
  EXPECT_FALSE(pty.is_cut());
  pty.cut();
  EXPECT_TRUE(pty.is_cut());
  EXPECT_FALSE(std::filesystem::exists(pty.path()));
  EXPECT_EQ(pty.read(kSoon), "");
  pty.write("nobody hears this");
  pty.restore();
  EXPECT_TRUE(std::filesystem::exists(pty.path()));
}

}  // namespace
}  // namespace rig::drivers
