#include "tests/drivers/v4l2_camera/bench.h"

#include "drivers/conformance/module_under_test.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {

namespace {

constexpr std::size_t kWidth = 64;
constexpr int kBits = 12;
constexpr std::chrono::milliseconds kFrameWithin{2000};
constexpr std::chrono::milliseconds kLongest{128};
// A camera that runs free goes on to send frames of the setting, and each is as good as the one before. So
// all are spoilt until the check has waited long enough for one.
constexpr std::chrono::milliseconds kSpoilt = kLongest + kFrameWithin + std::chrono::milliseconds(500);

class Peer final : public conformance::CameraPeer {
 public:
  explicit Peer(sim::wire::V4l2Camera& device) : device_(device) {}

  [[nodiscard]] std::optional<double> exposure_in(std::span<const std::uint16_t> pixels) override {
    const auto facts = sim::wire::read_video(pixels, kWidth, kBits);
    return facts ? facts->exposure_us * 1e-6 : -1;  // pixels that contradict each other are no exposure
  }
  bool corrupt_next() override {
    device_.spoil_from_next_setting(sim::wire::V4l2Camera::Trouble::flagged, kSpoilt);
    return true;
  }
  bool drop_next() override {
    device_.spoil_from_next_setting(sim::wire::V4l2Camera::Trouble::dropped, kSpoilt);
    return true;
  }

 private:
  sim::wire::V4l2Camera& device_;
};

class Plug final : public conformance::Wire {
 public:
  explicit Plug(sim::wire::V4l2Camera& device) : device_(device) {}

  bool cut() override {
    device_.unplug();
    return true;
  }
  bool restore() override {
    device_.plug();
    return true;
  }

 private:
  sim::wire::V4l2Camera& device_;
};

class SocketBench final : public conformance::Bench {
 public:
  [[nodiscard]] std::string name() const override { return "v4l2_camera"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override { device_.plug(); }
  [[nodiscard]] conformance::Wire& wire() override { return wire_; }
  [[nodiscard]] std::optional<conformance::CameraUnderTest> camera() override {
    conformance::CameraUnderTest test;
    test.device = "camera";
    test.peer = &peer_;
    test.exposures_s = {1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3, 128e-3};
    test.frame_within = kFrameWithin;
    return test;
  }

 private:
  static sim::wire::V4l2CameraOptions options() {
    sim::wire::V4l2CameraOptions options;
    options.padding = 16;
    options.interval_s = 0.002;
    options.readout_s = 0.0005;
    options.delay_frames = 2;
    return options;
  }

  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  const test::TemporaryFolder folder_;
  const std::filesystem::path path_ = socket_path();
  const conformance::ModuleUnderTest module_{
      "v4l2_camera", "device = \"" + device_of(path_) + "\"\npixel_format = \"SBGGR12\"\n", folder_.path()};
  sim::wire::V4l2Camera device_{path_, options()};
  Plug wire_{device_};
  Peer peer_{device_};
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<SocketBench>();
}

}  // namespace rig::drivers::v4l2
