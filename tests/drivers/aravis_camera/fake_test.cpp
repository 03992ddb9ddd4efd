// The driver on what Aravis brings along, untouched: its camera inside this process, which runs free and
// cannot be triggered, and its simulated GigE Vision camera as Debian ships it. The steepness of their ramp
// tells the exposure.
#include <arv.h>
#include <csignal>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/drivers/aravis_camera/support.h"

extern char** environ;

namespace rig::drivers::aravis {
namespace {

const std::string kInside = "id = \"Fake_1\"\ntransport = \"fake\"\nwidth = 256\nheight = 16\n";

void expect_ramp(Rig& rig, double exposure_s) {
  const auto frame = rig.take(exposure_s);
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  ASSERT_TRUE(frame->has_value());
  EXPECT_NEAR((*frame)->exposure_s, exposure_s, 1e-6);
  EXPECT_NEAR(exposure_in_ramp(rig.pixels(), rig.capabilities().width), exposure_s, 0.02 * exposure_s);
}

TEST(FakeInside, NoFrameIsFromBeforeItsSetting) {
  Rig rig(kInside);
  EXPECT_EQ(rig.capabilities().bits, 16);
  ASSERT_TRUE(rig.camera().arm().has_value());
  for (int i = 0; i < 30; ++i) {
    expect_ramp(rig, i % 2 == 0 ? 2e-3 : 20e-3);
    if (HasFatalFailure()) return;
  }
}

TEST(FakeInside, FramesThatNobodyFetchedDoNotDisturb) {
  Rig rig(kInside);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(rig.camera().trigger(30e-3, 1).has_value());
    ASSERT_TRUE(rig.camera().abort().has_value());
    expect_ramp(rig, 3e-3);
  }
}

// Debian's arv-fake-gv-camera-0.8, as long as it lives.
class Shipped {
 public:
  Shipped() {
    std::string program = "arv-fake-gv-camera-0.8", option = "-i", address = "127.0.0.1";
    std::array<char*, 4> argv{program.data(), option.data(), address.data(), nullptr};
    running_ = ::posix_spawnp(&pid_, program.c_str(), nullptr, nullptr, argv.data(), environ) == 0;
  }
  ~Shipped() {
    if (!running_) return;
    ::kill(pid_, SIGTERM);
    int status = 0;
    ::waitpid(pid_, &status, 0);
  }
  Shipped(const Shipped&) = delete;
  Shipped& operator=(const Shipped&) = delete;
  [[nodiscard]] bool running() const { return running_; }

 private:
  pid_t pid_ = 0;
  bool running_ = false;
};

TEST(FakeShipped, NoFrameIsFromBeforeItsSetting) {
  if (!has_own_network()) GTEST_SKIP() << "this user may not have a network of its own";
  const Shipped camera;
  ASSERT_TRUE(camera.running());
  Rig rig("address = \"127.0.0.1\"\nwidth = 256\nheight = 64\n");
  for (int i = 0; i < 20; ++i) {
    expect_ramp(rig, i % 2 == 0 ? 2e-3 : 20e-3);
    if (HasFatalFailure()) return;
  }
}

}  // namespace
}  // namespace rig::drivers::aravis
