// Whatever bytes come from a DMX widget: messages are found in them or nothing is, and none is invented.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "drivers/dmx_light/widget_protocol.h"

namespace {

using namespace rig::drivers::dmx_light;

// What the readers make of it is an error with a text, or a value that makes sense.
void read(const Message& message) {
  if (const auto parameters = read_parameters(message)) {
    if (parameters->packets_per_s < 0 || parameters->packets_per_s > 40) std::abort();
  } else if (parameters.error().what.empty()) {
    std::abort();
  }
  if (const auto serial = read_serial(message); serial && serial->size() != 8) std::abort();
  if (const auto name = read_name(message)) {
    for (const char c : *name) {
      if (c < ' ' || c > '~') std::abort();
    }
  }
}

}  // namespace

// The first byte says in how large pieces the rest comes, as on a line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = data[0] + std::size_t{1};
  const std::string all(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::string come;
  std::size_t noise = 0, taken = 0;
  for (std::size_t at = 0; at < all.size(); at += piece) {
    come += all.substr(at, piece);
    while (const auto message = take_message(come, noise)) {
      if (message->data.size() > kLongestData) std::abort();
      taken += message->data.size() + 5;
      read(*message);
      // What was read can be written, and is read as the same.
      std::string again = encode(static_cast<Label>(message->label), message->data);
      std::size_t no_noise = 0;
      const auto same = take_message(again, no_noise);
      if (!same || no_noise != 0 || !again.empty() || same->label != message->label ||
          same->data != message->data) {
        std::abort();
      }
    }
    // Never more than one message that is still coming.
    if (come.size() > kLongestData + 5) std::abort();
  }
  if (noise + taken + come.size() != all.size()) std::abort();
  return 0;
}
