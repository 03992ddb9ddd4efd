// Frames on the same machine: no copy, no waiting, and nobody who looks too long is deceived.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/frame_door.h"
#include "protocol/frame_reader.h"
#include "tests/core/temporary_folder.h"

namespace rig::protocol {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{20000};
constexpr std::uint32_t kWidth = 64;
constexpr std::uint32_t kHeight = 48;

class LocalFrames : public testing::Test {
 protected:
  void SetUp() override {
    auto buffer = FrameBuffer::make(std::size_t{kWidth} * kHeight);
    ASSERT_TRUE(buffer.has_value()) << buffer.error().text();
    buffer_.emplace(std::move(*buffer));
    auto door = FrameDoor::open(folder_.path());
    ASSERT_TRUE(door.has_value()) << door.error().text();
    door_ = std::move(*door);
  }
  FrameReader connect() {
    const std::size_t before = door_->clients();
    auto reader = FrameReader::connect(folder_ / "frames.sock");
    EXPECT_TRUE(reader.has_value()) << reader.error().text();
    // It is let in by the door's own thread.
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (door_->clients() == before && std::chrono::steady_clock::now() < end) {
    }
    return std::move(*reader);
  }
  void take(std::uint16_t value) {
    buffer_->begin();
    for (std::uint16_t& pixel : buffer_->pixels()) pixel = value;
    LocalFrame frame;
    frame.set_generation(buffer_->complete());
    frame.set_width(kWidth);
    frame.set_height(kHeight);
    frame.set_counter(value);
    door_->publish(frame, *buffer_);
  }
  static SeenFrame seen(FrameReader& reader) {
    auto next = reader.next(kPatience);
    EXPECT_TRUE(next.has_value() && next->has_value());
    return next && *next ? **next : SeenFrame{};
  }

  test::TemporaryFolder folder_;
  std::optional<FrameBuffer> buffer_;
  std::unique_ptr<FrameDoor> door_;
};

TEST_F(LocalFrames, ArriveAtEveryClientAndAreLostToTheNext) {
  FrameReader first = connect();
  FrameReader second = connect();
  take(17);
  for (FrameReader* reader : {&first, &second}) {
    const SeenFrame frame = seen(*reader);
    ASSERT_EQ(frame.pixels.size(), std::size_t{kWidth} * kHeight);
    EXPECT_EQ(frame.pixels.front(), 17);
    EXPECT_EQ(frame.pixels.back(), 17);
    EXPECT_EQ(frame.facts.counter(), 17U);
    EXPECT_EQ(frame.facts.missed(), 0U);
    EXPECT_TRUE(frame.intact());
  }
  take(18);
  const SeenFrame frame = seen(first);
  EXPECT_EQ(frame.pixels.front(), 18);
  EXPECT_TRUE(frame.intact());
  buffer_->begin();
  EXPECT_FALSE(frame.intact()) << "from the first pixel of the next frame on";
}

TEST_F(LocalFrames, CannotBeWrittenByThoseWhoGetThem) {
  EXPECT_EQ(::mmap(nullptr, kPixelsAt, PROT_READ | PROT_WRITE, MAP_SHARED, buffer_->descriptor(), 0),
            MAP_FAILED);
  const std::string again = fmt::format("/proc/self/fd/{}", buffer_->descriptor());
  const int fd = ::open(again.c_str(), O_RDWR | O_CLOEXEC);
  if (fd >= 0) {  // root may open it; the seal holds all the same
    EXPECT_EQ(::mmap(nullptr, kPixelsAt, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0), MAP_FAILED);
    EXPECT_EQ(::write(fd, "x", 1), -1);
    EXPECT_EQ(::ftruncate(fd, 0), -1);
    ::close(fd);
  }
}

TEST_F(LocalFrames, AClientThatDoesNotReadIsNotWaitedForAndLearnsWhatItMissed) {
  FrameReader reader = connect();
  constexpr std::uint16_t kFrames = 3000;
  for (std::uint16_t i = 0; i < kFrames; ++i) take(i);
  std::uint64_t told = 0;
  std::optional<SeenFrame> last;
  while (true) {
    auto next = reader.next(milliseconds(0));
    ASSERT_TRUE(next.has_value());
    if (!*next) break;
    ++told;
    if (last) {
      EXPECT_FALSE(last->intact());
    }
    last = **next;
  }
  ASSERT_LT(told, kFrames) << "the socket held all: nothing was tested";
  take(kFrames);
  EXPECT_EQ(told + seen(reader).facts.missed(), kFrames);
}

TEST_F(LocalFrames, WhoWentIsForgottenAndAnEndOfRigdIsTold) {
  FrameReader stays = connect();
  { const FrameReader goes = connect(); }
  take(1);
  EXPECT_EQ(door_->clients(), 1U);
  EXPECT_EQ(seen(stays).pixels.front(), 1);
  door_.reset();
  EXPECT_FALSE(stays.next(kPatience).has_value());
  EXPECT_FALSE(FrameReader::connect(folder_ / "frames.sock").has_value());
}

TEST_F(LocalFrames, TheSocketIsForOwnerAndGroupAndReplacesALeftOver) {
  struct stat is {};
  ASSERT_EQ(::stat((folder_ / "frames.sock").c_str(), &is), 0);
  EXPECT_EQ(is.st_mode & 0777U, 0660U);
  const auto again = FrameDoor::open(folder_.path());
  EXPECT_TRUE(again.has_value());
}

}  // namespace
}  // namespace rig::protocol
