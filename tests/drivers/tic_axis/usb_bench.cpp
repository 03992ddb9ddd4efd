#include "tests/drivers/tic_axis/usb_bench.h"

#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gtest/gtest.h>
#include <mutex>
#include <thread>
#include <unistd.h>

#include "sim/wire/vhci.h"
#include "tests/drivers/tic_axis/bench.h"

namespace rig::drivers::tic::test {

namespace {

using conformance::Spoil;
using sim::wire::ControlAnswer;
using sim::wire::SetupPacket;
using sim::wire::VhciPlug;
using std::chrono::milliseconds;

// Longer than the driver waits for any transfer.
constexpr milliseconds kLate{400};

std::string own_serial() {
  return fmt::format("{:08}", ::getpid());
}

sim::wire::TicWorld world() {
  sim::wire::TicWorld world;
  world.serial = own_serial();
  return world;
}

std::string line_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

// Whether the kernel has met the Tic and programs can open it.
bool is_enumerated() {
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/bus/usb/devices", gone)) {
    if (line_of(entry.path() / "serial") != own_serial()) continue;
    const std::string bus = line_of(entry.path() / "busnum"), device = line_of(entry.path() / "devnum");
    if (bus.empty() || device.empty()) return false;
    return std::filesystem::exists(fmt::format("/dev/bus/usb/{:0>3}/{:0>3}", bus, device));
  }
  return false;
}

// The Tic's plug, and the answers of the Tic on their way to the host. What the host asks of every USB device
// is answered whole.
class UsbWire final : public TicWire {
 public:
  explicit UsbWire(sim::wire::Tic& tic) : tic_(tic) { plug_in(); }
  [[nodiscard]] std::string transport() const override { return "usb"; }
  void heal() override {
    {
      const std::lock_guard lock(mutex_);
      left_ = 0;
    }
    restore();
  }
  bool cut() override {
    plug_.reset();
    return true;
  }
  bool restore() override {
    if (!plug_) plug_in();
    return true;
  }
  bool spoil(Spoil how, int answers) override {
    // The host controller keeps transfers apart: none is answered twice.
    if (how == Spoil::duplicate) return false;
    const std::lock_guard lock(mutex_);
    how_ = how;
    left_ = answers;
    return true;
  }

 private:
  static bool is_of_all_devices(const SetupPacket& setup) { return (setup.request_type & 0x60U) == 0; }

  ControlAnswer answer(const SetupPacket& setup, std::span<const std::uint8_t> out) {
    ControlAnswer got = tic_.control(setup, out);
    if (is_of_all_devices(setup)) return got;
    Spoil how{};
    {
      const std::lock_guard lock(mutex_);
      if (left_ == 0) return got;
      --left_;
      how = how_;
    }
    if (how == Spoil::missing) return {ControlAnswer::Kind::silence, {}};
    if (how == Spoil::late) {
      std::this_thread::sleep_for(kLate);
    } else if (setup.is_in()) {
      std::fill(got.data.begin(), got.data.end(), std::uint8_t{0xEE});
    } else {
      return ControlAnswer::stalled();
    }
    return got;
  }

  // Another program may have taken the port that was free a moment ago.
  void plug_in() {
    constexpr int kTries = 50;
    const auto handler = [this](const SetupPacket& setup, std::span<const std::uint8_t> out) {
      return answer(setup, out);
    };
    auto plugged = VhciPlug::plug_in(handler, sim::wire::UsbSpeed::full);
    for (int i = 1; i < kTries && !plugged; ++i) {
      std::this_thread::sleep_for(milliseconds(20));
      plugged = VhciPlug::plug_in(handler, sim::wire::UsbSpeed::full);
    }
    ASSERT_TRUE(plugged) << plugged.error().text();
    plug_ = std::move(*plugged);
    // In software emulation the kernel takes its time to meet a device, and two are met one after the other.
    constexpr int kLooks = 600;
    for (int i = 0; i < kLooks && !is_enumerated(); ++i) std::this_thread::sleep_for(milliseconds(20));
    ASSERT_TRUE(is_enumerated()) << "the kernel did not meet the Tic that was plugged in";
  }

  sim::wire::Tic& tic_;
  std::mutex mutex_;
  Spoil how_{};
  int left_ = 0;
  std::unique_ptr<VhciPlug> plug_;
};

}  // namespace

bool has_virtual_usb() {
  return std::filesystem::exists(sim::wire::kVhci);
}

std::unique_ptr<conformance::Bench> make_usb_bench() {
  // In software emulation, with other tests beside this one.
  constexpr milliseconds kStopBound{1000};
  // The suite itself is so slow there that it would seem to be gone.
  return make_bench_on(
      "tic_axis_usb", world(), [](sim::wire::Tic& tic) { return std::make_unique<UsbWire>(tic); }, kStopBound,
      "silence_ms = 20000\n");
}

}  // namespace rig::drivers::tic::test
