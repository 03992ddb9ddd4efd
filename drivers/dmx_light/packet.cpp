#include "drivers/dmx_light/packet.h"

#include <algorithm>
#include <cmath>

namespace rig::drivers::dmx_light {

namespace {

unsigned int most_steps(const DmxSettings& settings) {
  return settings.fine_channel ? 0xFFFFU : 0xFFU;
}

unsigned int steps_of(const DmxSettings& settings, double level) {
  return static_cast<unsigned int>(std::lround(std::clamp(level, 0.0, 1.0) * most_steps(settings)));
}

}  // namespace

double nearest_level(const DmxSettings& settings, double level) {
  return static_cast<double>(steps_of(settings, level)) / most_steps(settings);
}

std::string make_packet(const DmxSettings& settings, double level, bool shutter_open) {
  std::string channels(settings.channels, '\0');
  const auto put = [&](std::size_t channel, unsigned int value) {
    channels.at(channel - 1) = static_cast<char>(value);
  };
  for (const Channel& fixed : settings.fixed) put(fixed.number, fixed.value);
  const unsigned int steps = steps_of(settings, level);
  put(settings.level_channel, settings.fine_channel ? steps >> 8U : steps);
  if (settings.fine_channel) put(*settings.fine_channel, steps & 0xFFU);
  if (settings.shutter) {
    put(settings.shutter->channel, shutter_open ? settings.shutter->open : settings.shutter->closed);
  }
  return channels;
}

}  // namespace rig::drivers::dmx_light
