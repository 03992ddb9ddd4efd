// The simulated video device keeps the kernel's rules.
#include "sim/wire/v4l2_camera.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

namespace rig::sim::wire {
namespace {

class Program {
 public:
  explicit Program(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.native().copy(address.sun_path, path.native().size());
    connected_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~Program() { ::close(fd_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  template <typename T>
  [[nodiscard]] int ask(unsigned long code, T& argument) const {
    std::array<std::uint8_t, sizeof(std::uint32_t) + sizeof(T)> packet{};
    const auto number = static_cast<std::uint32_t>(code);
    std::memcpy(packet.data(), &number, sizeof number);
    std::memcpy(packet.data() + sizeof number, &argument, sizeof argument);
    if (::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL) < 0) return -1;
    if (::recv(fd_, packet.data(), packet.size(), 0) != static_cast<ssize_t>(packet.size())) return -1;
    std::memcpy(&argument, packet.data() + sizeof number, sizeof argument);
    std::int32_t error = 0;
    std::memcpy(&error, packet.data(), sizeof error);
    return error;
  }
  [[nodiscard]] bool connected() const { return connected_; }

  [[nodiscard]] int buffers(std::uint32_t count) const {
    v4l2_requestbuffers request{};
    request.count = count;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    return ask(VIDIOC_REQBUFS, request);
  }
  [[nodiscard]] int buffer(unsigned long code, std::uint32_t index, v4l2_buffer* said = nullptr) const {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    const int error = ask(code, buffer);
    if (said != nullptr) *said = buffer;
    return error;
  }
  [[nodiscard]] int stream(bool on) const {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    return ask(on ? VIDIOC_STREAMON : VIDIOC_STREAMOFF, type);
  }
  [[nodiscard]] int format(std::uint32_t fourcc) const {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.pixelformat = fourcc;
    return ask(VIDIOC_S_FMT, format);
  }
  [[nodiscard]] int control(std::uint32_t id, std::int32_t value) const {
    v4l2_control control{id, value};
    return ask(VIDIOC_S_CTRL, control);
  }
  // The next frame that is handed out.
  [[nodiscard]] v4l2_buffer frame() const {
    v4l2_buffer said{};
    while (buffer(VIDIOC_DQBUF, 0, &said) == EAGAIN)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return said;
  }

 private:
  const int fd_;
  bool connected_ = false;
};

class V4l2CameraTest : public testing::Test {
 protected:
  const std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("rig-sim-v4l2-" + std::to_string(::getpid()));
  V4l2Camera camera_{path_};
};

TEST_F(V4l2CameraTest, BuffersAreWhereTheyAre) {
  const Program program(path_);
  EXPECT_EQ(program.stream(true), EINVAL) << "no buffers";
  EXPECT_EQ(program.format(V4L2_PIX_FMT_GREY), 0);
  EXPECT_EQ(program.buffers(2), 0);
  EXPECT_EQ(program.format(V4L2_PIX_FMT_Y12), EBUSY);
  EXPECT_EQ(program.buffer(VIDIOC_QUERYBUF, 2), EINVAL);
  EXPECT_EQ(program.buffer(VIDIOC_QBUF, 2), EINVAL);
  EXPECT_EQ(program.buffer(VIDIOC_QBUF, 0), 0);
  EXPECT_EQ(program.buffer(VIDIOC_QBUF, 0), EINVAL) << "queued already";
  EXPECT_EQ(program.buffer(VIDIOC_DQBUF, 0), EINVAL) << "not streaming";
  EXPECT_EQ(program.stream(true), 0);
  EXPECT_EQ(program.buffers(4), EBUSY);
  EXPECT_EQ(program.frame().index, 0U);
  EXPECT_EQ(program.buffer(VIDIOC_DQBUF, 0), EAGAIN) << "no other is queued";
  EXPECT_EQ(program.stream(false), 0);
  EXPECT_EQ(program.buffers(0), 0);
  EXPECT_EQ(program.format(V4L2_PIX_FMT_Y12), 0);
}

TEST_F(V4l2CameraTest, FramesWithoutABufferAreLostAndNumbered) {
  const Program program(path_);
  ASSERT_EQ(program.format(V4L2_PIX_FMT_GREY), 0);
  ASSERT_EQ(program.buffers(2), 0);
  ASSERT_EQ(program.buffer(VIDIOC_QBUF, 0), 0);
  ASSERT_EQ(program.stream(true), 0);
  const auto first = program.frame();
  EXPECT_EQ(first.sequence, 0U);
  EXPECT_EQ(first.bytesused, 64U * 48U);
  EXPECT_EQ(first.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK, unsigned{V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC});
  while (camera_.frames() < 6) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_EQ(program.buffer(VIDIOC_QBUF, 0), 0);
  const auto second = program.frame();
  EXPECT_GE(second.sequence, 4U);
  EXPECT_GT(second.timestamp.tv_sec * 1'000'000 + second.timestamp.tv_usec,
            first.timestamp.tv_sec * 1'000'000 + first.timestamp.tv_usec);
}

TEST_F(V4l2CameraTest, ControlsAreRoundedAndMenusAreNot) {
  const Program program(path_);
  EXPECT_EQ(program.control(V4L2_CID_GAIN, 1000), 0);
  EXPECT_EQ(camera_.control("Gain"), 255);
  EXPECT_EQ(program.control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_SHUTTER_PRIORITY), EINVAL)
      << "not in its menu";
  EXPECT_EQ(program.control(V4L2_CID_EXPOSURE_AUTO, 4), ERANGE);
  EXPECT_EQ(program.control(V4L2_CID_CAMERA_CLASS_BASE + 200, 20), EACCES) << "only to be read";
  EXPECT_EQ(program.control(V4L2_CID_GAMMA, 1), EINVAL) << "it has none";
  int nonsense = 0;
  EXPECT_EQ(program.ask(VIDIOC_G_INPUT, nonsense), ENOTTY);
}

TEST_F(V4l2CameraTest, WhoClaimsItHasItAlone) {
  const Program first(path_), second(path_);
  std::uint32_t priority = V4L2_PRIORITY_RECORD;
  EXPECT_EQ(first.ask(VIDIOC_S_PRIORITY, priority), 0);
  EXPECT_EQ(second.control(V4L2_CID_GAIN, 3), EBUSY);
  EXPECT_EQ(second.format(V4L2_PIX_FMT_GREY), EBUSY);
  EXPECT_EQ(second.ask(VIDIOC_S_PRIORITY, priority), EBUSY);
  std::uint32_t highest = 0;
  EXPECT_EQ(second.ask(VIDIOC_G_PRIORITY, highest), 0);
  EXPECT_EQ(highest, std::uint32_t{V4L2_PRIORITY_RECORD});
  EXPECT_EQ(first.control(V4L2_CID_GAIN, 3), 0);
}

TEST_F(V4l2CameraTest, OnePluggedOutAnswersNoMoreAndForgets) {
  const Program program(path_);
  ASSERT_EQ(program.control(V4L2_CID_GAIN, 3), 0);
  camera_.unplug();
  EXPECT_EQ(program.control(V4L2_CID_GAIN, 4), ENODEV);
  EXPECT_FALSE(Program(path_).connected());
  camera_.plug();
  EXPECT_EQ(program.control(V4L2_CID_GAIN, 4), ENODEV) << "it was another plugging-in";
  EXPECT_TRUE(Program(path_).connected());
  EXPECT_EQ(camera_.control("Gain"), 8);
}

}  // namespace
}  // namespace rig::sim::wire
