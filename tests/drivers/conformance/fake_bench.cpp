#include "tests/drivers/conformance/fake_bench.h"

#include <fcntl.h>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/drivers/conformance/fake_axis.h"
#include "tests/drivers/conformance/fake_camera.h"
#include "tests/drivers/conformance/fake_drive.h"
#include "tests/drivers/conformance/fake_light.h"
#include "tests/drivers/conformance/fake_lines.h"
#include "tests/drivers/conformance/fake_wire.h"

namespace rig::drivers::conformance {

using base::ErrorCode;
using base::fail;

namespace {

// The wire with what hangs on it: a device that hears nothing for a while stops what it does.
class WatchedWire final : public Wire {
 public:
  WatchedWire(FakeWire& wire, FakeDrive& drive, FakeLinesBox& box) : wire_(wire), drive_(drive), box_(box) {}
  bool cut() override {
    (void)drive_.answer({kAxisStop});
    box_.abandon();
    return wire_.cut();
  }
  bool restore() override { return wire_.restore(); }
  bool spoil(Spoil how, int answers) override { return wire_.spoil(how, answers); }
  bool thin_out(int answers) override { return wire_.thin_out(answers); }

 private:
  FakeWire& wire_;
  FakeDrive& drive_;
  FakeLinesBox& box_;
};

// All that is at the other end, as after power-up.
struct FakeDevices {
  FakeDevices(base::Clock& clock, Flaw flaw)
      : wire(clock), drive(clock, flaw), sensor(clock), lamp(flaw), watched(wire, drive, box) {
    drive.power_up();
    wire.connect([this](const Words& request) -> Words {
      if (request.front() >= kLinesRead) return box.answer(request);
      if (request.front() >= kLightRead) return lamp.answer(request);
      return drive.answer(request);
    });
  }
  FakeWire wire;
  FakeDrive drive;
  FakeSensor sensor;
  FakeLamp lamp;
  FakeLinesBox box;
  WatchedWire watched;
};

// What leaks keep, so that it is theirs to the end of the bench.
struct Leaks {
  Leaks() = default;
  Leaks(const Leaks&) = delete;
  Leaks& operator=(const Leaks&) = delete;
  ~Leaks() {
    for (const int fd : descriptors) ::close(fd);
    {
      const std::lock_guard lock(mutex);
      over = true;
    }
    end.notify_all();
    for (std::thread& thread : threads) thread.join();
  }
  void thread() {
    threads.emplace_back([this] {
      std::unique_lock lock(mutex);
      end.wait(lock, [this] { return over; });
    });
  }

  std::vector<int> descriptors;
  std::vector<std::vector<char>> memory;
  std::vector<std::thread> threads;
  std::mutex mutex;
  std::condition_variable end;
  bool over = false;
};

// A module that runs no destructor while the check runs, as if its process had been killed.
class FakeVictim final : public Victim {
 public:
  FakeVictim(std::vector<Device> devices, std::vector<Device>& graveyard)
      : devices_(std::move(devices)), graveyard_(graveyard) {}
  FakeVictim(const FakeVictim&) = delete;
  FakeVictim& operator=(const FakeVictim&) = delete;
  ~FakeVictim() override { kill(); }
  void kill() override {
    std::move(devices_.begin(), devices_.end(), std::back_inserter(graveyard_));
    devices_.clear();
  }

 private:
  std::vector<Device> devices_;
  std::vector<Device>& graveyard_;
};

class FakeBench final : public Bench {
 public:
  explicit FakeBench(Flaw flaw) : flaw_(flaw) { reset(); }

  [[nodiscard]] std::string name() const override { return "fake"; }
  [[nodiscard]] base::Clock& clock() override { return *clock_; }
  [[nodiscard]] Wire& wire() override { return devices_->watched; }

  [[nodiscard]] base::Result<std::unique_ptr<Victim>> start_victim(const Task& task) override {
    auto devices = open();
    if (!devices) return base::pass(devices);
    if (auto begun = start(task, *devices, *clock_); !begun) return base::pass(begun);
    look_at(task, *devices);
    return std::make_unique<FakeVictim>(std::move(*devices), graveyard_);
  }

  void reset() override {
    graveyard_.clear();
    devices_ = std::make_unique<FakeDevices>(*clock_, flaw_);
    memory_ = {};
  }

  [[nodiscard]] base::Result<std::vector<Device>> open() override {
    leak();
    if (memory_.line_kept) return fail(ErrorCode::busy, "another program has the line", "fake");
    if (devices_->wire.is_cut()) {
      memory_.line_kept = flaw_ == Flaw::keeps_the_line;
      return fail(ErrorCode::lost, "it is not there", "fake");
    }
    std::vector<Device> devices;
    devices.push_back({"axis", "fake", make_fake_axis(devices_->wire, *clock_, memory_, flaw_)});
    devices.push_back({"camera", "fake", make_fake_camera(devices_->sensor, devices_->wire, *clock_, flaw_)});
    devices.push_back({"light", "fake", make_fake_light(devices_->wire, *clock_, flaw_)});
    devices.push_back({flaw_ == Flaw::twin_names ? "light" : "lines", "fake",
                       make_fake_lines(devices_->wire, *clock_, flaw_)});
    return devices;
  }

  [[nodiscard]] std::optional<AxisUnderTest> axis() override {
    return AxisUnderTest{"axis", &devices_->drive, -0.4321, 0.5678, 1, 4, std::chrono::milliseconds(50)};
  }
  [[nodiscard]] std::optional<CameraUnderTest> camera() override {
    return CameraUnderTest{"camera",
                           &devices_->sensor,
                           {0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064, 0.128},
                           1,
                           0.02,
                           std::chrono::milliseconds(500)};
  }
  [[nodiscard]] std::optional<LightUnderTest> light() override {
    return LightUnderTest{"light", &devices_->lamp};
  }
  [[nodiscard]] std::optional<LinesUnderTest> lines() override {
    return LinesUnderTest{"lines", &devices_->box, "button", "relay", false, std::chrono::milliseconds(100)};
  }

 private:
  void leak() {
    if (flaw_ == Flaw::throws_at_opening) throw std::runtime_error("no memory");
    if (flaw_ == Flaw::leaks_descriptor)
      leaks_.descriptors.push_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (flaw_ == Flaw::leaks_thread && leaks_.threads.size() < 50) leaks_.thread();
    if (flaw_ == Flaw::leaks_memory) leaks_.memory.emplace_back(2000);
  }

  const Flaw flaw_;
  const std::unique_ptr<base::Clock> clock_ = base::make_discrete_event_clock(base::Time(base::seconds(1e6)));
  std::unique_ptr<FakeDevices> devices_;
  FakeMemory memory_;
  Leaks leaks_;
  std::vector<Device> graveyard_;
};

}  // namespace

std::unique_ptr<Bench> make_fake_bench(Flaw flaw) {
  return std::make_unique<FakeBench>(flaw);
}

}  // namespace rig::drivers::conformance
