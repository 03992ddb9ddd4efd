#include "sim/wire/uvc_descriptors.h"

#include <initializer_list>

#include "sim/wire/uvc_format.h"
#include "sim/wire/uvc_request.h"

namespace rig::sim::wire {

namespace {

using Bytes = std::vector<std::uint8_t>;

// Descriptor types of USB 2.0 (9.4) and UVC (A.4), subtypes (A.5, A.6), class codes (A.1 to A.3).
enum Type : std::uint8_t {
  kDevice = 0x01,
  kConfiguration = 0x02,
  kInterface = 0x04,
  kEndpoint = 0x05,
  kAssociation = 0x0B,
  kClassInterface = 0x24,
  kClassEndpoint = 0x25,
};
enum ControlSubtype : std::uint8_t {
  kVcHeader = 0x01,
  kVcInput = 0x02,
  kVcOutput = 0x03,
  kVcProcessing = 0x05
};
enum StreamSubtype : std::uint8_t {
  kVsInputHeader = 0x01,
  kVsFormatUncompressed = 0x04,
  kVsFrameUncompressed = 0x05,
  kVsColour = 0x0D,
};
constexpr std::uint8_t kVideo = 0x0E, kVideoControl = 0x01, kVideoStreaming = 0x02, kVideoCollection = 0x03;
constexpr std::uint8_t kInwards = 0x80;
constexpr std::uint16_t kStatusPacket = 16;

// One descriptor: its length comes first and counts itself.
class Descriptor {
 public:
  explicit Descriptor(std::uint8_t type) : bytes_{0, type} {}
  Descriptor& b8(unsigned int value) {
    uvc_append(bytes_, value, 1);
    return *this;
  }
  Descriptor& b16(unsigned int value) {
    uvc_append(bytes_, value, 2);
    return *this;
  }
  Descriptor& b32(std::uint32_t value) {
    uvc_append(bytes_, value, 4);
    return *this;
  }
  Descriptor& raw(std::initializer_list<int> values) {
    for (const int value : values) b8(static_cast<unsigned int>(value));
    return *this;
  }
  [[nodiscard]] Bytes done() const {
    Bytes all = bytes_;
    all[0] = static_cast<std::uint8_t>(all.size());
    return all;
  }

 private:
  Bytes bytes_;
};

void append(Bytes& to, const Bytes& more) {
  to.insert(to.end(), more.begin(), more.end());
}

void put_total(Bytes& header, std::size_t at, std::size_t total) {
  header.at(at) = static_cast<std::uint8_t>(total & 0xFFU);
  header.at(at + 1) = static_cast<std::uint8_t>(total >> 8U);
}

Bytes interface(std::uint8_t number, std::uint8_t endpoints, std::uint8_t subclass) {
  return Descriptor(kInterface).raw({number, 0, endpoints, kVideo, subclass, 0, 0}).done();
}

Bytes control_interface() {
  using namespace uvc_number_of;
  constexpr unsigned int kVersion = 0x0110;
  constexpr unsigned int kCameraType = 0x0201, kStreamingType = 0x0101;
  // Bits of bmControls: mode and priority of automatic exposure and the exposure; brightness and gain.
  constexpr unsigned int kCameraControls = 0x0E, kProcessingControls = 0x0201;
  Bytes header = Descriptor(kClassInterface)
                     .b8(kVcHeader)
                     .b16(kVersion)
                     .b16(0)
                     .b32(kUvcClock_hz)
                     .raw({1, kStreamingInterface})
                     .done();
  Bytes units;
  append(units, Descriptor(kClassInterface)
                    .raw({kVcInput, kCamera})
                    .b16(kCameraType)
                    .raw({0, 0})
                    .b16(0)
                    .b16(0)
                    .b16(0)
                    .b8(3)
                    .b16(kCameraControls)
                    .b8(0)
                    .done());
  append(units, Descriptor(kClassInterface)
                    .raw({kVcProcessing, kProcessing, kCamera})
                    .b16(0)
                    .b8(2)
                    .b16(kProcessingControls)
                    .raw({0, 0})
                    .done());
  append(units, Descriptor(kClassInterface)
                    .raw({kVcOutput, kOutput})
                    .b16(kStreamingType)
                    .raw({0, kProcessing, 0})
                    .done());
  constexpr std::size_t kTotalAt = 5;
  put_total(header, kTotalAt, header.size() + units.size());
  Bytes all = interface(kControlInterface, 1, kVideoControl);
  append(all, header);
  append(all, units);
  constexpr int kInterrupt = 3, kInterval = 8;  // 2 to the seventh microframes
  append(all, Descriptor(kEndpoint)
                  .raw({kInwards | kStatusEndpoint, kInterrupt})
                  .b16(kStatusPacket)
                  .b8(kInterval)
                  .done());
  append(all, Descriptor(kClassEndpoint).b8(kInterrupt).b16(kStatusPacket).done());
  return all;
}

Bytes format_and_frames(std::uint8_t index) {
  const UvcFormat& format = kUvcFormats.at(index - std::size_t{1});
  Descriptor head(kClassInterface);
  head.raw({kVsFormatUncompressed, index, static_cast<int>(kUvcSizes.size())});
  for (const char each : format.four) head.b8(static_cast<unsigned char>(each));
  head.raw({0x00, 0x00, 0x10, 0x00, 0x80, 0x00, 0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71});
  constexpr int kBitsOfAByte = 8;
  head.raw({format.bytes * kBitsOfAByte, 1, 0, 0, 0, 0});
  Bytes all = head.done();
  for (std::size_t i = 0; i < kUvcSizes.size(); ++i) {
    const UvcSize& size = kUvcSizes.at(i);
    const std::uint32_t bytes = uvc_frame_bytes(format, size);
    const auto bits_a_second = [&](std::uint32_t interval) {
      constexpr std::uint64_t kIntervals = 10'000'000;
      return static_cast<std::uint32_t>(bytes * std::uint64_t{kBitsOfAByte} * kIntervals / interval);
    };
    Descriptor frame(kClassInterface);
    frame.raw({kVsFrameUncompressed, static_cast<int>(i + 1), 0}).b16(size.width).b16(size.height);
    frame.b32(bits_a_second(kUvcIntervals.back())).b32(bits_a_second(kUvcIntervals.front())).b32(bytes);
    frame.b32(kUvcIntervals.front()).b8(kUvcIntervals.size());
    for (const std::uint32_t interval : kUvcIntervals) frame.b32(interval);
    append(all, frame.done());
  }
  // BT.709 primaries and transfer, SMPTE 170M matrix: the class asks for the descriptor also of grey.
  append(all, Descriptor(kClassInterface).raw({kVsColour, 1, 1, 4}).done());
  return all;
}

Bytes streaming_interface() {
  using namespace uvc_number_of;
  constexpr std::size_t kTotalAt = 4;
  Descriptor head(kClassInterface);
  head.raw({kVsInputHeader, static_cast<int>(kUvcFormats.size())}).b16(0);
  head.raw({kInwards | kVideoEndpoint, 0, kOutput, 0, 0, 0, 1});
  for (std::size_t i = 0; i < kUvcFormats.size(); ++i) head.b8(0);
  Bytes header = head.done();
  Bytes formats;
  for (std::size_t i = 0; i < kUvcFormats.size(); ++i) {
    append(formats, format_and_frames(static_cast<std::uint8_t>(i + 1)));
  }
  put_total(header, kTotalAt, header.size() + formats.size());
  Bytes all = interface(kStreamingInterface, 1, kVideoStreaming);
  append(all, header);
  append(all, formats);
  constexpr int kBulk = 2;
  constexpr unsigned int kBulkPacket = 512;  // of high speed
  append(all, Descriptor(kEndpoint).raw({kInwards | kVideoEndpoint, kBulk}).b16(kBulkPacket).b8(0).done());
  return all;
}

}  // namespace

UsbDescription uvc_description(const std::string& serial) {
  // pid.codes keeps this product for tests.
  constexpr unsigned int kVendor = 0x1209, kProduct = 0x0001, kRelease = 0x0100, kUsb = 0x0200;
  constexpr int kMiscellaneous = 0xEF, kCommon = 2, kByAssociation = 1, kBusPowered = 0x80, k500mA = 250;
  UsbDescription made;
  made.device = Descriptor(kDevice)
                    .b16(kUsb)
                    .raw({kMiscellaneous, kCommon, kByAssociation, 64})
                    .b16(kVendor)
                    .b16(kProduct)
                    .b16(kRelease)
                    .raw({1, 2, 3, 1})
                    .done();
  Bytes parts = Descriptor(kAssociation)
                    .raw({uvc_number_of::kControlInterface, 2, kVideo, kVideoCollection, 0, 0})
                    .done();
  append(parts, control_interface());
  append(parts, streaming_interface());
  made.configuration = Descriptor(kConfiguration).b16(0).raw({2, 1, 0, kBusPowered, k500mA}).done();
  put_total(made.configuration, 2, made.configuration.size() + parts.size());
  append(made.configuration, parts);
  made.strings = {{1, "rigd"}, {2, "Simulated UVC camera"}, {3, serial}};
  return made;
}

}  // namespace rig::sim::wire
