// What the device refuses, and who is said to be at fault: the camera, another program, or the bus.
#include <cerrno>
#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include "drivers/v4l2_camera/video_node.h"
#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using base::ErrorCode;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Device = sim::wire::V4l2Camera;

const std::string kStated = "pixel_format = \"GREY\"\nmeasure_settling = false\nsettle_frames = 2\n";
constexpr int kAlways = 1'000'000;

class Refusal : public testing::Test {
 protected:
  [[nodiscard]] base::Error error_of_opening() {
    const auto clock = base::make_system_clock();
    const auto opened =
        V4l2Camera::open(settings_of("device = \"" + device_of(path_) + "\"\nopen_ms = 1000\n" + kStated),
                         *clock, Said().log());
    EXPECT_FALSE(opened.has_value());
    return opened ? base::Error{} : opened.error();
  }

  const std::filesystem::path path_ = socket_path();
  Device device_{path_};
};

TEST_F(Refusal, EachErrorOfAControlIsTheCameras) {
  struct Row {
    int error;
    ErrorCode code;
    const char* text;
  };
  for (const Row& row :
       {Row{EACCES, ErrorCode::device, "the camera refuses it in its present state"},
        Row{EREMOTE, ErrorCode::device, "the camera has not the power for it"},
        Row{ERANGE, ErrorCode::device, "the camera says that it is out of range"},
        Row{EINVAL, ErrorCode::device, "the camera knows no such control or value"},
        Row{EPIPE, ErrorCode::lost, "the camera refuses it, and says no reason"},
        Row{EILSEQ, ErrorCode::lost, "the camera does not answer, or refuses it"},
        Row{EIO, ErrorCode::lost, "the camera does not answer, or knows no such control"},
        Row{ETIMEDOUT, ErrorCode::lost, "it does not answer"}, Row{ENODEV, ErrorCode::lost, "it is gone"}}) {
    SCOPED_TRACE(row.text);
    Rig rig(device_of(path_), kStated);
    expect_frame(rig, 1e-3);
    device_.fail_next(VIDIOC_S_CTRL, row.error);
    const auto refused = rig.camera().trigger(2e-3, 1);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, row.code);
    EXPECT_THAT(refused.error().text(),
                AllOf(HasSubstr(row.text), HasSubstr("it failed to set exposure_time_absolute to 20"),
                      Not(HasSubstr("another program"))));
    ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
    expect_frame(rig, 2e-3);
  }
}

TEST_F(Refusal, ACameraThatIsNotReadyIsAskedAgain) {
  Rig rig(device_of(path_), kStated);
  for (const unsigned long request : {VIDIOC_S_CTRL, VIDIOC_G_CTRL}) {
    expect_frame(rig, 1e-3);
    device_.fail_next(request, EBUSY, 5);
    expect_frame(rig, 2e-3);
  }
}

TEST_F(Refusal, ACameraThatDoesNotGetReadyIsBusyAndNobodyElseIsBlamed) {
  for (const char* exclusive : {"true", "false"}) {
    Rig rig(device_of(path_), kStated + "exclusive = " + exclusive + "\n");
    expect_frame(rig, 1e-3);
    device_.fail_next(VIDIOC_S_CTRL, EBUSY, kAlways);
    const auto begun = std::chrono::steady_clock::now();
    const auto refused = rig.camera().trigger(2e-3, 1);
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(2000));
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::busy);
    EXPECT_THAT(refused.error().text(), AllOf(HasSubstr("the camera is not ready: it failed to set exposure"),
                                              Not(HasSubstr("another program"))));
    device_.fail_next(VIDIOC_S_CTRL, 0, 0);
    expect_frame(rig, 2e-3);
  }
}

TEST_F(Refusal, WhoClaimedItMeanwhileIsTold) {
  Rig rig(device_of(path_), kStated + "exclusive = false\n");
  expect_frame(rig, 1e-3);
  auto other = open_node(device_of(path_));
  ASSERT_TRUE(other.has_value());
  ASSERT_EQ((*other)->claim(), 0);
  const auto refused = rig.camera().trigger(2e-3, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::busy);
  EXPECT_THAT(refused.error().text(), HasSubstr("another program has claimed it: it failed to set exposure"));
  other->reset();
  ASSERT_TRUE(eventually([&] { return rig.camera().trigger(2e-3, 1).has_value(); }));
}

TEST_F(Refusal, ABusyStreamIsAnotherPrograms) {
  for (const auto& [request, what] :
       {std::pair{VIDIOC_S_PRIORITY, "to be ours alone"},
        std::pair{VIDIOC_S_FMT, "to set its format to GREY"}, std::pair{VIDIOC_REQBUFS, "buffers"},
        std::pair{VIDIOC_STREAMON, "to start its stream"}}) {
    device_.fail_next(request, EBUSY);
    const auto error = error_of_opening();
    EXPECT_EQ(error.code, ErrorCode::busy);
    EXPECT_THAT(error.text(), AllOf(HasSubstr("another program uses it"), HasSubstr(what)));
  }
}

TEST_F(Refusal, ABusThatIsFullIsSaid) {
  device_.fail_next(VIDIOC_STREAMON, ENOSPC);
  const auto error = error_of_opening();
  EXPECT_EQ(error.code, ErrorCode::device);
  EXPECT_THAT(error.text(), HasSubstr("its bus has not room enough for its frames"));
}

TEST_F(Refusal, ACameraThatIsNotReadyWhenItIsOpenedIsNotAnotherPrograms) {
  device_.fail_next(VIDIOC_S_CTRL, EBUSY, kAlways);
  const auto error = error_of_opening();
  EXPECT_EQ(error.code, ErrorCode::busy);
  EXPECT_THAT(error.text(), AllOf(HasSubstr("the camera is not ready"), Not(HasSubstr("another program"))));
}

}  // namespace
}  // namespace rig::drivers::v4l2
