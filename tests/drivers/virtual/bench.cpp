#include "tests/drivers/virtual/bench.h"

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <stdexcept>

#include "core/base/files.h"
#include "core/base/units.h"
#include "drivers/host/module_loader.h"
#include "sim/ride.h"
#include "sim/state_file.h"
#include "tests/core/temporary_folder.h"

namespace rig::sim {

namespace fs = std::filesystem;
using base::radians;
namespace conformance = drivers::conformance;

namespace {

constexpr std::size_t kPan = 2;

// A small machine: four equal axes, a camera that paints its exposure, a lamp that is warm at once.
constexpr const char* kSettings = R"(
seed = 1
wire_log = "wire.log"
[camera]
width = 160
height = 120
fx_px = 600
fy_px = 600
cx_px = 79.5
cy_px = 59.5
distance_mm = 1000
bits = 12
black_dn = 64
saturation_dn = 4095
electrons_per_dn = 8
read_noise_e = 6
sensitivity = [0.6, 1.0, 0.7]
white_fills_ms = 60
min_exposure_us = 50
max_exposure_us = 2000000
readout_ms = 200
render = "hash"
[light]
arm_radius_mm = 1000
aperture_mm = 20
warm_up_s = 0
[carrier]
plane_offset_mm = 20
carrier_mm = 200
sample_mm = 160
tags = []
patches = []
)";

constexpr const char* kAxis = R"(
resolution_deg = 0.0129
repeatability_deg = 0.786
backlash_deg = 0.05
low_deg = -95.0
high_deg = 95.0
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 120.0
homing_velocity_deg_s = 20.0
home_deg = 0.0
power_on_deg = 5.0
)";

base::ConfigTable settings() {
  std::string text = kSettings;
  for (const char* axis : kAxisNames) text += fmt::format("[axis.{}]{}", axis, kAxis);
  auto table = base::ConfigTable::parse(text, "bench");
  if (!table) throw std::runtime_error(table.error().text());
  return *table;
}

void to_standard_error(base::LogLevel /*level*/, std::string_view message) {
  std::fprintf(stderr, "%.*s\n", static_cast<int>(message.size()), message.data());
}

// The state folder of the module: what it remembers, and the files that cause faults.
class WorldFolder {
 public:
  explicit WorldFolder(const World& world) : world_(world) {}

  void clear() {
    for (const auto& entry : fs::directory_iterator(folder_.path())) fs::remove_all(entry.path());
  }
  [[nodiscard]] const fs::path& path() const { return folder_.path(); }
  [[nodiscard]] Memory memory() const {
    auto file = StateFile::open(folder_ / "world.state");
    if (!file) throw std::runtime_error(file.error().text());
    return file->load();
  }
  [[nodiscard]] const World& world() const { return world_; }

  bool cause(const std::string& faults) {
    return base::write_file_durably(folder_ / "faults.toml", std::string_view(faults)).has_value();
  }
  bool mend() { return fs::remove(folder_ / "faults.toml"); }
  void press(bool on) {
    if (on) test::put_bytes(folder_ / "emergency_stop", "");
    if (!on) fs::remove(folder_ / "emergency_stop");
  }

 private:
  test::TemporaryFolder folder_;
  const World world_;
};

class VirtualWire final : public conformance::Wire {
 public:
  explicit VirtualWire(WorldFolder& folder) : folder_(folder) {}
  bool cut() override { return folder_.cause("[[fault]]\nkind = \"unplugged\"\n"); }
  bool restore() override { return folder_.mend(); }

 private:
  WorldFolder& folder_;
};

class VirtualAxisPeer final : public conformance::AxisPeer {
 public:
  VirtualAxisPeer(WorldFolder& folder, base::Clock& clock) : folder_(folder), clock_(clock) {}
  [[nodiscard]] double position_rad() override { return axis_position(axis(), world(), now_ns()); }
  [[nodiscard]] bool moving() override { return axis_moving(axis(), world(), now_ns()); }
  [[nodiscard]] int stops_seen() override {
    const std::string log = test::bytes_in(folder_.path() / "wire.log");
    int stops = 0;
    const std::string_view stop = " stop pan\n";
    for (auto at = log.find(stop); at != std::string::npos; at = log.find(stop, at + 1)) ++stops;
    return stops;
  }

 private:
  [[nodiscard]] AxisMemory axis() const { return folder_.memory().axes[kPan]; }
  [[nodiscard]] const AxisWorld& world() const { return folder_.world().axes[kPan]; }
  [[nodiscard]] std::int64_t now_ns() const { return clock_.now().time_since_epoch().count(); }

  WorldFolder& folder_;
  base::Clock& clock_;
};

class VirtualCameraPeer final : public conformance::CameraPeer {
 public:
  explicit VirtualCameraPeer(WorldFolder& folder) : folder_(folder) {}
  // Samples are spread evenly from black to what the exposure fills: their mean is half of it, and that of
  // nineteen thousand is known to 0.4 %.
  [[nodiscard]] std::optional<double> exposure_in(std::span<const std::uint16_t> pixels) override {
    const CameraWorld& camera = folder_.world().camera;
    const double sum = std::accumulate(pixels.begin(), pixels.end(), 0.0);
    const double mean = sum / static_cast<double>(pixels.size()) + 0.5 - camera.black_dn;
    return 2 * mean / (camera.saturation_dn - camera.black_dn) * camera.white_fills_s;
  }
  bool drop_next() override { return folder_.cause("[[fault]]\nkind = \"dropped-frame\"\ntimes = 1\n"); }

 private:
  WorldFolder& folder_;
};

class VirtualLightPeer final : public conformance::LightPeer {
 public:
  explicit VirtualLightPeer(WorldFolder& folder) : folder_(folder) {}
  [[nodiscard]] double level() override {
    const Memory memory = folder_.memory();
    return memory.shutter_open != 0 ? memory.light_level : 0;
  }

 private:
  WorldFolder& folder_;
};

class VirtualLinesPeer final : public conformance::LinesPeer {
 public:
  explicit VirtualLinesPeer(WorldFolder& folder) : folder_(folder) {}
  void set_input(const std::string& /*line*/, bool active) override { folder_.press(active); }
  [[nodiscard]] bool output(const std::string& /*line*/) override { return false; }

 private:
  WorldFolder& folder_;
};

class VirtualBench final : public conformance::Bench {
 public:
  VirtualBench() {
    auto loaded = drivers::load_module(RIG_BINARY_DIR "/lib/librig_driver_virtual.so", {});
    if (!loaded) throw std::runtime_error(loaded.error().text());
    entry_ = *loaded;
  }

  [[nodiscard]] std::string name() const override { return "virtual"; }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  [[nodiscard]] conformance::Wire& wire() override { return wire_; }

  [[nodiscard]] base::Result<std::vector<drivers::Device>> open() override {
    return entry_->open({"virtual", settings_, folder_.path(), *clock_, &to_standard_error});
  }

  // A new world, whose lamp shines: frames need light.
  void reset() override {
    folder_.clear();
    auto devices = open();
    if (!devices) throw std::runtime_error(devices.error().text());
    for (drivers::Device& device : *devices) {
      auto* light = std::get_if<std::unique_ptr<drivers::Light>>(&device.is);
      if (light == nullptr) continue;
      if (!(*light)->set_level(1) || !(*light)->set_shutter(true))
        throw std::runtime_error("the lamp is dark");
    }
  }

  [[nodiscard]] std::optional<conformance::AxisUnderTest> axis() override {
    return conformance::AxisUnderTest{
        "pan", &axis_, radians(-40), radians(35), radians(60), radians(120), std::chrono::milliseconds(50)};
  }
  [[nodiscard]] std::optional<conformance::CameraUnderTest> camera() override {
    return conformance::CameraUnderTest{
        "camera", &camera_, {0.002, 0.003, 0.005, 0.008, 0.013, 0.021, 0.034, 0.055},
        1,        0.02,     std::chrono::milliseconds(500)};
  }
  [[nodiscard]] std::optional<conformance::LightUnderTest> light() override {
    return conformance::LightUnderTest{"light", &light_};
  }
  // Its one output is a pulse, which has no level.
  [[nodiscard]] std::optional<conformance::LinesUnderTest> lines() override {
    return conformance::LinesUnderTest{"lines", &lines_, "emergency_stop",
                                       "",      false,   std::chrono::milliseconds(100)};
  }

 private:
  const std::unique_ptr<base::Clock> clock_ = base::make_discrete_event_clock(base::Time(base::seconds(1e9)));
  const base::ConfigTable settings_ = settings();
  WorldFolder folder_{read_world(settings_)};
  VirtualWire wire_{folder_};
  VirtualAxisPeer axis_{folder_, *clock_};
  VirtualCameraPeer camera_{folder_};
  VirtualLightPeer light_{folder_};
  VirtualLinesPeer lines_{folder_};
  const drivers::ModuleEntry* entry_ = nullptr;
};

}  // namespace

std::unique_ptr<conformance::Bench> make_bench() {
  return std::make_unique<VirtualBench>();
}

}  // namespace rig::sim
