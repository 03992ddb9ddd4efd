#include "sim/wire/cp2112.h"

#include <utility>

namespace rig::sim::wire {

namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = ControlAnswer::Kind;

// Reports, with the bytes behind the report's number.
enum Report : std::uint8_t {
  kGpioConfig = 0x02,  // directions, push-pull, special functions, clock divider
  kGpioGet = 0x03,     // levels
  kGpioSet = 0x04,     // levels, mask
  kVersion = 0x05,     // part, version
  kSmbusConfig = 0x06,
  kReadResponse = 0x13,
  kWrite = 0x14,
  kLock = 0x20,
  kUsbConfig = 0x21,
};

struct ReportSize {
  std::uint8_t report;
  std::uint8_t bytes;
};
constexpr std::array kFeatures{
    ReportSize{kGpioConfig, 4},   ReportSize{kGpioGet, 1}, ReportSize{kGpioSet, 2},   ReportSize{kVersion, 2},
    ReportSize{kSmbusConfig, 13}, ReportSize{kLock, 1},    ReportSize{kUsbConfig, 9},
};
constexpr std::uint8_t kLongReport = 61;

constexpr std::uint8_t kPart = 0x0C, kDeviceVersion = 0x03;
constexpr std::uint16_t kVendor = 0x10C4, kProduct = 0xEA90;

// Requests of HID (7.2): type and number.
constexpr std::uint8_t kToInterface = 0x21, kFromInterface = 0xA1;
constexpr std::uint8_t kGetReport = 0x01, kSetReport = 0x09, kSetIdle = 0x0A, kSetProtocol = 0x0B;
constexpr std::uint8_t kStandardFromInterface = 0x81, kGetDescriptor = 0x06;
constexpr std::uint8_t kHidDescriptor = 0x21, kReportDescriptor = 0x22;

std::uint8_t bit(unsigned int pin) {
  return static_cast<std::uint8_t>(1U << pin);
}

// HID's descriptor within the interface, 6.2.1.
Bytes hid_descriptor(std::size_t reports) {
  return {9,
          kHidDescriptor,
          0x11,
          0x01,
          0,
          1,
          kReportDescriptor,
          static_cast<std::uint8_t>(reports & 0xFFU),
          static_cast<std::uint8_t>(reports >> 8U)};
}

// 100 kHz, address 2, no automatic read, no time-outs, no retries; numbers with the high byte first.
Bytes usual_smbus() {
  return {0x00, 0x01, 0x86, 0xA0, 0x02, 0, 0, 0, 0, 0, 0, 0, 0};
}

}  // namespace

Bytes cp2112_report_descriptor() {
  // Usage page: vendor-defined; usage 1; a collection.
  Bytes d{0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01};
  const auto add = [&](std::uint8_t report, std::uint8_t bytes, std::uint8_t item) {
    // Report id, count, 8 bits each, 0 to 255, usage 1, and whether it is input, output or feature (data,
    // variable, absolute).
    for (const std::uint8_t byte :
         {std::uint8_t{0x85}, report, std::uint8_t{0x95}, bytes, std::uint8_t{0x75}, std::uint8_t{8},
          std::uint8_t{0x26}, std::uint8_t{0xFF}, std::uint8_t{0}, std::uint8_t{0x15}, std::uint8_t{0},
          std::uint8_t{0x09}, std::uint8_t{1}, item, std::uint8_t{0x02}}) {
      d.push_back(byte);
    }
  };
  for (const ReportSize& feature : kFeatures) add(feature.report, feature.bytes, 0xB1);
  add(kReadResponse, kLongReport, 0x81);
  add(kWrite, kLongReport, 0x91);
  d.push_back(0xC0);
  return d;
}

UsbDescription cp2112_description(const std::string& serial) {
  // As a device of a vendor's own class, and then its class is that of its interface: HID.
  UsbDescription made = vendor_device(
      {kVendor, kProduct, 0x0100}, "Silicon Laboratories", "CP2112 HID USB-to-SMBus Bridge", serial,
      {{0x81, UsbEndpoint::Kind::interrupt, 64, 1}, {0x01, UsbEndpoint::Kind::interrupt, 64, 1}});
  constexpr std::size_t kDeviceClass = 4, kInterface = 9, kInterfaceClass = 5, kInterfaceLength = 9;
  constexpr std::uint8_t kHid = 3;
  made.device.at(kDeviceClass) = 0;
  Bytes& c = made.configuration;
  c.at(kInterface + kInterfaceClass) = kHid;
  const Bytes hid = hid_descriptor(cp2112_report_descriptor().size());
  c.insert(c.begin() + kInterface + kInterfaceLength, hid.begin(), hid.end());
  constexpr std::size_t kTotalLow = 2;
  c.at(kTotalLow) = static_cast<std::uint8_t>(c.size());
  return made;
}

Cp2112::Cp2112(const std::string& serial) : standard_(cp2112_description(serial)), smbus_(usual_smbus()) {}

bool Cp2112::Pin::high() const {
  if (driven) return *driven;
  if (output && (push_pull || !latch)) return latch;
  return true;
}

void Cp2112::note(Pin& pin, bool before) {
  if (pin.high() != before) pin.changes.push_back({std::chrono::steady_clock::now(), pin.high()});
}

ControlAnswer Cp2112::control(const SetupPacket& setup, std::span<const std::uint8_t> out) {
  const std::lock_guard lock(mutex_);
  const auto type = static_cast<std::uint8_t>(setup.value >> 8U);
  const auto number = static_cast<std::uint8_t>(setup.value & 0xFFU);
  if (setup.request_type == kStandardFromInterface && setup.request == kGetDescriptor) {
    if (type == kReportDescriptor) return {Kind::done, cp2112_report_descriptor()};
    if (type == kHidDescriptor) return {Kind::done, hid_descriptor(cp2112_report_descriptor().size())};
  }
  if (auto answer = standard_.answer(setup)) return std::move(*answer);
  const bool of_report = (setup.request_type == kFromInterface && setup.request == kGetReport) ||
                         (setup.request_type == kToInterface && setup.request == kSetReport);
  if (of_report && stalling_ > 0) {
    --stalling_;
    return ControlAnswer::stalled();
  }
  if (setup.request_type == kFromInterface && setup.request == kGetReport) return get_report(number);
  if (setup.request_type == kToInterface) {
    if (setup.request == kSetReport) return set_report(out);
    if (setup.request == kSetIdle || setup.request == kSetProtocol) return {};
  }
  return ControlAnswer::stalled();
}

ControlAnswer Cp2112::get_report(std::uint8_t report) {
  std::uint8_t levels = 0, directions = 0, push_pull = 0;
  for (unsigned int pin = 0; pin < kPins; ++pin) {
    if (pins_[pin].high()) levels |= bit(pin);
    if (pins_[pin].output) directions |= bit(pin);
    if (pins_[pin].push_pull) push_pull |= bit(pin);
  }
  switch (report) {
    case kGpioConfig:
      return {Kind::done, {report, directions, push_pull, special_, clock_divider_}};
    case kGpioGet:
      return {Kind::done, {report, levels}};
    case kVersion:
      return {Kind::done, {report, kPart, kDeviceVersion}};
    case kSmbusConfig: {
      Bytes answer{report};
      answer.insert(answer.end(), smbus_.begin(), smbus_.end());
      return {Kind::done, answer};
    }
    case kLock:  // everything is programmed
      return {Kind::done, {report, 0}};
    case kUsbConfig:
      return {Kind::done,
              {report, kVendor & 0xFFU, kVendor >> 8U, kProduct & 0xFFU, kProduct >> 8U, 50, 0, 1, 0, 0}};
    default:
      return ControlAnswer::stalled();
  }
}

ControlAnswer Cp2112::set_report(std::span<const std::uint8_t> report) {
  if (report.empty()) return ControlAnswer::stalled();
  const auto is = [&](std::uint8_t number, std::size_t bytes) {
    return report[0] == number && report.size() == bytes + 1;
  };
  if (is(kGpioConfig, 4)) {
    configure(report[1], report[2]);
    special_ = report[3];
    clock_divider_ = report[4];
    return {};
  }
  if (is(kGpioSet, 2)) {
    set_latches(report[1], report[2]);
    return {};
  }
  if (is(kSmbusConfig, 13)) {
    smbus_.assign(report.begin() + 1, report.end());
    return {};
  }
  return ControlAnswer::stalled();
}

void Cp2112::configure(std::uint8_t directions, std::uint8_t push_pull) {
  for (unsigned int pin = 0; pin < kPins; ++pin) {
    const bool before = pins_[pin].high();
    pins_[pin].output = (directions & bit(pin)) != 0;
    pins_[pin].push_pull = (push_pull & bit(pin)) != 0;
    note(pins_[pin], before);
  }
}

// AN495, 4.4: only for pins that are outputs.
void Cp2112::set_latches(std::uint8_t values, std::uint8_t mask) {
  for (unsigned int pin = 0; pin < kPins; ++pin) {
    if ((mask & bit(pin)) == 0 || !pins_[pin].output) continue;
    const bool before = pins_[pin].high();
    pins_[pin].latch = (values & bit(pin)) != 0;
    note(pins_[pin], before);
  }
}

void Cp2112::drive(unsigned int pin, std::optional<bool> high) {
  const std::lock_guard lock(mutex_);
  pins_.at(pin).driven = high;
}

bool Cp2112::high(unsigned int pin) const {
  const std::lock_guard lock(mutex_);
  return pins_.at(pin).high();
}

bool Cp2112::is_output(unsigned int pin) const {
  const std::lock_guard lock(mutex_);
  return pins_.at(pin).output;
}

std::vector<Cp2112::Change> Cp2112::changes(unsigned int pin) {
  const std::lock_guard lock(mutex_);
  return std::exchange(pins_.at(pin).changes, {});
}

void Cp2112::power_cycle() {
  const std::lock_guard lock(mutex_);
  for (Pin& pin : pins_) {
    Pin fresh;
    fresh.driven = pin.driven;
    pin = std::move(fresh);
  }
  special_ = clock_divider_ = 0;
  smbus_ = usual_smbus();
  stalling_ = 0;
}

void Cp2112::stall_next(int reports) {
  const std::lock_guard lock(mutex_);
  stalling_ = reports;
}

}  // namespace rig::sim::wire
