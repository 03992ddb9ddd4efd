#include "drivers/dmx_light/settings.h"

#include <algorithm>
#include <cctype>
#include <map>

#include "drivers/dmx_light/widget_protocol.h"

namespace rig::drivers::dmx_light {

namespace {

constexpr std::int64_t kMostValue = 255;
constexpr std::size_t kDigits = 8;

std::size_t read_channel(const base::ConfigTable& table, const char* key) {
  return static_cast<std::size_t>(table.integer(key, 1, kMostChannels));
}

std::uint8_t read_value(const base::ConfigTable& table, const char* key, std::uint8_t usual) {
  return static_cast<std::uint8_t>(table.integer_or(key, usual, 0, kMostValue));
}

std::string read_serial_key(const base::ConfigTable& settings) {
  std::string serial = settings.text_or("serial", "");
  const bool digits = std::all_of(serial.begin(), serial.end(),
                                  [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; });
  if (!digits || serial.size() > kDigits) {
    settings.error("serial", fmt::format("'{}' is no serial number of a widget", serial),
                   "the eight digits printed on it");
    return {};
  }
  for (char& c : serial) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (!serial.empty()) serial.insert(0, kDigits - serial.size(), '0');
  return serial;
}

std::vector<Channel> read_fixed(const base::ConfigTable& settings) {
  std::vector<Channel> fixed;
  if (!settings.has("fixed")) return fixed;
  for (const auto& row : settings.rows("fixed", 2)) {
    const auto whole = [](double number, double low, double high) {
      return number >= low && number <= high && number == static_cast<double>(static_cast<int>(number));
    };
    if (!whole(row[0], 1, kMostChannels) || !whole(row[1], 0, kMostValue)) {
      settings.error("fixed", fmt::format("[{}, {}] is no channel and its value", row[0], row[1]),
                     "a channel from 1 to 512 and a value from 0 to 255");
      continue;
    }
    fixed.push_back({static_cast<std::size_t>(row[0]), static_cast<std::uint8_t>(row[1])});
  }
  return fixed;
}

void check_channels(const base::ConfigTable& settings, const DmxSettings& dmx) {
  std::map<std::size_t, const char*> used;
  const auto use = [&](const char* key, std::size_t channel) {
    const auto [other, is_new] = used.emplace(channel, key);
    if (!is_new) {
      settings.error(key, fmt::format("channel {} is that of {} already", channel, other->second));
    }
    if (channel > dmx.channels) {
      settings.error(key, fmt::format("channel {} is beyond the {} that are put out", channel, dmx.channels),
                     "raise `channels`");
    }
  };
  use("channel", dmx.level_channel);
  if (dmx.fine_channel) use("fine_channel", *dmx.fine_channel);
  if (dmx.shutter) use("shutter", dmx.shutter->channel);
  for (const Channel& fixed : dmx.fixed) use("fixed", fixed.number);
}

}  // namespace

DmxSettings read_dmx_settings(const base::ConfigTable& settings) {
  DmxSettings dmx;
  // A widget has no baud rate: its line is one of USB from end to end.
  SerialSettings usual;
  usual.baud = 57600;
  dmx.line = read_serial_settings(settings, usual);
  dmx.retry = read_retry_policy(settings);
  dmx.serial = read_serial_key(settings);
  dmx.ask_names = settings.boolean_or("ask_names", false);
  dmx.channels = static_cast<std::size_t>(
      settings.integer_or("channels", kMostChannels, kFewestChannels, kMostChannels));
  dmx.level_channel = read_channel(settings, "channel");
  if (settings.has("fine_channel")) dmx.fine_channel = read_channel(settings, "fine_channel");
  if (const auto table = settings.table_if("shutter")) {
    Shutter shutter;
    shutter.channel = read_channel(*table, "channel");
    shutter.open = read_value(*table, "open", shutter.open);
    shutter.closed = read_value(*table, "closed", shutter.closed);
    if (shutter.open == shutter.closed) table->error("closed", "open and closed are the same value");
    dmx.shutter = shutter;
  }
  dmx.fixed = read_fixed(settings);
  dmx.at_start_level = settings.number_or("at_start_level", 0, {0, 1});
  dmx.at_exit_level = settings.number_or("at_exit_level", 0, {0, 1});
  dmx.warm_up_s = settings.number_or("warm_up_s", 0, {0, 86400});
  check_channels(settings, dmx);
  return dmx;
}

}  // namespace rig::drivers::dmx_light
