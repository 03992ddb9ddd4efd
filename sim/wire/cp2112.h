// A Silicon Labs CP2112, the USB bridge to SMBus and eight lines, as its reports are in AN495 and as Linux'
// hid-cp2112 asks for them. Of SMBus there is what that driver needs to begin; no device is on the bus.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/wire/usb.h"

namespace rig::sim::wire {

class Cp2112 {
 public:
  static constexpr unsigned int kPins = 8;
  using Time = std::chrono::steady_clock::time_point;

  explicit Cp2112(const std::string& serial);

  /// A transfer over the control endpoint, descriptors and reports of HID included: for a UsbIpDevice. Any
  /// thread, as all below.
  [[nodiscard]] ControlAnswer control(const SetupPacket& setup, std::span<const std::uint8_t> out);

  /// What is wired to the pin drives it to that level; nothing: lets it go. An output's pin follows whatever
  /// drives it from outside: a short circuit.
  void drive(unsigned int pin, std::optional<bool> high);
  /// What nobody drives is high: the boards pull it up.
  [[nodiscard]] bool high(unsigned int pin) const;
  [[nodiscard]] bool is_output(unsigned int pin) const;

  struct Change {
    Time at;
    bool high;
  };
  /// How the chip's own driver changed a pin since this was asked before.
  [[nodiscard]] std::vector<Change> changes(unsigned int pin);

  /// As after it was plugged in: every pin is an input.
  void power_cycle();
  /// The next so many reports stall.
  void stall_next(int reports);

 private:
  struct Pin {
    std::optional<bool> driven;
    bool output = false, push_pull = false, latch = true;
    std::vector<Change> changes;
    [[nodiscard]] bool high() const;
  };

  [[nodiscard]] ControlAnswer get_report(std::uint8_t report);
  [[nodiscard]] ControlAnswer set_report(std::span<const std::uint8_t> report);
  void configure(std::uint8_t directions, std::uint8_t push_pull);
  void set_latches(std::uint8_t values, std::uint8_t mask);
  void note(Pin& pin, bool before);

  mutable std::mutex mutex_;
  StandardRequests standard_;
  std::array<Pin, kPins> pins_;
  std::uint8_t special_ = 0, clock_divider_ = 0;
  std::vector<std::uint8_t> smbus_;
  int stalling_ = 0;
};

/// The descriptor of its reports (HID 1.11, 6.2.2).
[[nodiscard]] std::vector<std::uint8_t> cp2112_report_descriptor();
[[nodiscard]] UsbDescription cp2112_description(const std::string& serial);

}  // namespace rig::sim::wire
