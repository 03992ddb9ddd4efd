#include "drivers/dmx_light/widget_protocol.h"

#include <cctype>

namespace rig::drivers::dmx_light {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr char kBegin = '\x7E';
constexpr char kEnd = '\xE7';
constexpr std::size_t kHead = 4;  // begin, label, length
constexpr std::size_t kLongestName = 32;
constexpr std::size_t kId = 2;  // of a manufacturer or device, in front of its name

std::size_t byte_at(std::string_view bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

tl::unexpected<base::Error> wrong(const Message& message, const char* what) {
  return fail(ErrorCode::damaged, fmt::format("{}: {} bytes", what, message.data.size()));
}

}  // namespace

std::string encode(Label label, std::string_view data) {
  std::string bytes;
  bytes.reserve(kHead + data.size() + 1);
  bytes.push_back(kBegin);
  bytes.push_back(static_cast<char>(label));
  bytes.push_back(static_cast<char>(data.size() & 0xFFU));
  bytes.push_back(static_cast<char>(data.size() >> 8U));
  bytes.append(data);
  bytes.push_back(kEnd);
  return bytes;
}

std::string encode_output(std::string_view channels) {
  std::string data(1, '\0');
  data.append(channels);
  return encode(Label::dmx_output, data);
}

std::string encode_parameters_request() {
  return encode(Label::parameters, std::string(2, '\0'));
}

std::optional<Message> take_message(std::string& bytes, std::size_t& noise) {
  const auto drop = [&](std::size_t count) {
    bytes.erase(0, count);
    noise += count;
  };
  while (true) {
    const auto begin = bytes.find(kBegin);
    if (begin != 0) drop(std::min(begin, bytes.size()));
    if (bytes.size() < kHead) return std::nullopt;
    const std::size_t length = byte_at(bytes, 2) + (byte_at(bytes, 3) << 8U);
    if (length > kLongestData) {
      drop(1);
      continue;
    }
    if (bytes.size() <= kHead + length) return std::nullopt;
    if (bytes[kHead + length] != kEnd) {
      drop(1);
      continue;
    }
    Message message{static_cast<std::uint8_t>(bytes[1]), bytes.substr(kHead, length)};
    bytes.erase(0, kHead + length + 1);
    return message;
  }
}

Result<Parameters> read_parameters(const Message& message) {
  constexpr std::size_t kParameters = 5;
  constexpr int kFastest = 40;
  if (message.data.size() < kParameters) return wrong(message, "these are no parameters of a widget");
  Parameters parameters;
  parameters.firmware_minor = static_cast<int>(byte_at(message.data, 0));
  parameters.firmware_major = static_cast<int>(byte_at(message.data, 1));
  parameters.packets_per_s = static_cast<int>(byte_at(message.data, 4));
  if (parameters.packets_per_s > kFastest) {
    return fail(ErrorCode::damaged, fmt::format("a widget puts out at most {} packets a second, not {}",
                                                kFastest, parameters.packets_per_s));
  }
  return parameters;
}

Result<std::string> read_serial(const Message& message) {
  if (message.data.size() != 4) return wrong(message, "this is no serial number of a widget");
  std::string digits;
  for (std::size_t i = message.data.size(); i-- > 0;) {
    digits += fmt::format("{:02X}", byte_at(message.data, i));
  }
  return digits;
}

Result<std::string> read_name(const Message& message) {
  if (message.data.size() < kId || message.data.size() > kId + kLongestName + 1) {
    return wrong(message, "this is no name of a widget");
  }
  std::string name;
  for (const char c : std::string_view(message.data).substr(kId)) {
    if (c == '\0') break;
    if (std::isprint(static_cast<unsigned char>(c)) != 0) name.push_back(c);
  }
  return name;
}

}  // namespace rig::drivers::dmx_light
