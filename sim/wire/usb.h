// USB as a device sees it: control transfers, descriptors, standard requests.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace rig::sim::wire {

/// The eight bytes that begin a control transfer (USB 2.0, 9.3).
struct SetupPacket {
  std::uint8_t request_type = 0;  ///< bit 7: towards the host; 5-6: 0 standard, 1 class, 2 vendor
  std::uint8_t request = 0;
  std::uint16_t value = 0, index = 0;
  std::uint16_t length = 0;  ///< of the data stage

  [[nodiscard]] bool is_in() const { return (request_type & 0x80U) != 0; }
  friend bool operator==(const SetupPacket&, const SetupPacket&) = default;
};

[[nodiscard]] SetupPacket parse_setup(std::span<const std::uint8_t, 8> bytes);
[[nodiscard]] std::array<std::uint8_t, 8> bytes_of(const SetupPacket& setup);

struct ControlAnswer {
  enum class Kind {
    done,     ///< with `data` where the transfer goes towards the host
    stall,    ///< the device does not know such a request
    silence,  ///< the device never answers; the host gives up
  } kind = Kind::done;
  std::vector<std::uint8_t> data = {};

  [[nodiscard]] static ControlAnswer stalled() { return {Kind::stall, {}}; }
};

/// Carries out a control transfer; `out` is its data stage towards the device. More data than the host asked
/// for is cut by whoever carries them.
using ControlHandler = std::function<ControlAnswer(const SetupPacket&, std::span<const std::uint8_t> out)>;

struct UsbDescription {
  std::vector<std::uint8_t> device;             ///< the device descriptor, 18 bytes
  std::vector<std::uint8_t> configuration;      ///< the configuration with all that belongs to it
  std::map<std::uint8_t, std::string> strings;  ///< by index, ASCII
};

struct UsbIdentity {
  std::uint16_t vendor = 0, product = 0;
  std::uint16_t release = 0;  ///< bcdDevice: 0x0106 is 1.06
};

struct UsbEndpoint {
  std::uint8_t address = 0;  ///< bit 7: towards the host
  enum class Kind : std::uint8_t { bulk = 2, interrupt = 3 } kind = Kind::bulk;
  std::uint16_t packet = 64;
  std::uint8_t interval = 0;
};

/// A device with one configuration of one vendor-specific interface, powered by the bus. Its strings 1, 2 and
/// 3 are manufacturer, product and serial number.
[[nodiscard]] UsbDescription vendor_device(const UsbIdentity& identity, const std::string& manufacturer,
                                           const std::string& product, const std::string& serial,
                                           const std::vector<UsbEndpoint>& endpoints = {});

/// Answers the standard requests of chapter 9 from a description.
class StandardRequests {
 public:
  explicit StandardRequests(UsbDescription description) : description_(std::move(description)) {}

  /// Nothing for a request of class or vendor: those are the device's own.
  [[nodiscard]] std::optional<ControlAnswer> answer(const SetupPacket& setup);

 private:
  [[nodiscard]] ControlAnswer descriptor(const SetupPacket& setup) const;

  const UsbDescription description_;
  std::uint8_t configuration_ = 0;
};

}  // namespace rig::sim::wire
