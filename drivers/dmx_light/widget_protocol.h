// The messages between a computer and an ENTTEC DMX USB Pro ("widget API 1.44"): 0x7E, a label, the length of
// the data in two bytes, low first, the data, 0xE7.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace rig::drivers::dmx_light {

enum class Label : std::uint8_t {
  parameters = 3,     ///< asked and answered; does not disturb what the widget puts out
  dmx_output = 6,     ///< no answer: the widget puts this packet out, again and again, until told otherwise
  serial = 10,        ///< asked and answered; ends the output
  manufacturer = 77,  ///< an extension that ENTTEC's own do not answer; ends the output
  device = 78,
};

/// Longest data of a message.
inline constexpr std::size_t kLongestData = 600;
/// Fewest and most channels of a packet.
inline constexpr std::size_t kFewestChannels = 24, kMostChannels = 512;

struct Message {
  std::uint8_t label = 0;
  std::string data;
};

[[nodiscard]] std::string encode(Label label, std::string_view data);
/// A packet of all channels, behind the start code 0 of dimmers.
[[nodiscard]] std::string encode_output(std::string_view channels);
/// Asks for the parameters without any of the data that the user may have stored with them.
[[nodiscard]] std::string encode_parameters_request();

/// The first whole message in `bytes`, taken off them with all that is in front of it. Nothing: more bytes
/// are needed, and what can no longer be the beginning of a message is gone. `noise` counts bytes that were
/// of no message.
[[nodiscard]] std::optional<Message> take_message(std::string& bytes, std::size_t& noise);

struct Parameters {
  int firmware_major = 0, firmware_minor = 0;
  int packets_per_s = 0;  ///< 0: as fast as it can
};
[[nodiscard]] base::Result<Parameters> read_parameters(const Message& message);
/// The eight digits printed on the widget, "02301234". A widget whose digits are none (FFFFFFFF: it was never
/// given any) is told apart by them all the same.
[[nodiscard]] base::Result<std::string> read_serial(const Message& message);
/// The text of a manufacturer or a device, without what cannot be printed.
[[nodiscard]] base::Result<std::string> read_name(const Message& message);

}  // namespace rig::drivers::dmx_light
