#include "tests/drivers/aravis_camera/bench.h"

#include "drivers/conformance/module_under_test.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {

namespace {

constexpr std::size_t kWidth = 512;
constexpr int kBits = 12;
// The simulated camera remembers a trigger while it is stopped, and obeys it up to 0.1 s after it was started
// again, or later where the machine is busy: the driver waits for a readout and more before the next trigger.
const std::string kSettings =
    "address = \"127.0.0.1\"\npixel_format = \"BayerRG12p\"\nwidth = 512\nheight = 384\npacket_size = 1400\n"
    "readout_ms = 250\nanswer_ms = 1800\n";

class Peer final : public conformance::CameraPeer {
 public:
  explicit Peer(sim::wire::GvCameraProcess& process) : process_(process) {}

  [[nodiscard]] std::optional<double> exposure_in(std::span<const std::uint16_t> pixels) override {
    const auto facts = sim::wire::read_pattern(pixels, kWidth, kBits);
    return facts ? facts->exposure_us * 1e-6 : -1;  // pixels that contradict each other are no exposure
  }
  bool corrupt_next() override { return process_.command("corrupt"); }
  bool drop_next() override { return process_.command("drop"); }

 private:
  sim::wire::GvCameraProcess& process_;
};

class GigeWire final : public conformance::Wire {
 public:
  explicit GigeWire(sim::wire::GvCameraProcess& process) : process_(process) {}

  bool cut() override { return process_.command("vanish"); }
  bool restore() override { return process_.command("return"); }

 private:
  sim::wire::GvCameraProcess& process_;
};

class GigeBench final : public conformance::Bench {
 public:
  [[nodiscard]] std::string name() const override { return "aravis_camera"; }
  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    return conformance::open_module(module_, *clock_);
  }
  [[nodiscard]] base::Result<std::unique_ptr<conformance::Victim>> start_victim(
      const conformance::Task& task) override {
    return conformance::start_victim(module_, task);
  }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  void reset() override { (void)process_.command("return"); }
  [[nodiscard]] conformance::Wire& wire() override { return wire_; }
  [[nodiscard]] std::optional<conformance::CameraUnderTest> camera() override {
    conformance::CameraUnderTest test;
    test.device = "camera";
    test.peer = &peer_;
    test.exposures_s = {1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3, 128e-3};
    return test;
  }

 private:
  test::TemporaryFolder folder_;
  const conformance::ModuleUnderTest module_{"aravis_camera", kSettings, folder_.path()};
  std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  sim::wire::GvCameraProcess process_ = start_camera({"--exposes"});
  GigeWire wire_{process_};
  Peer peer_{process_};
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<GigeBench>();
}

}  // namespace rig::drivers::aravis
