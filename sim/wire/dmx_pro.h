// An ENTTEC DMX USB Pro at the other end of a serial line, after its "Widget API Specification 1.44".
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace rig::sim::wire {

class DmxPro {
 public:
  /// The line is a link at `line`; the serial number is eight digits.
  DmxPro(const std::filesystem::path& line, const std::string& serial);
  ~DmxPro();
  DmxPro(const DmxPro&) = delete;
  DmxPro& operator=(const DmxPro&) = delete;

  /// What goes out of the DMX socket, again and again, from channel 1 on; nothing: its direction is input.
  /// Only packets with the start code of dimmers.
  [[nodiscard]] std::vector<std::uint8_t> output();
  /// Requests that have come, by label; 0xFF stands for messages that made no sense.
  [[nodiscard]] int requests(std::uint8_t label);

  /// Fixtures at the socket stay as they are while nothing is put out.
  [[nodiscard]] std::vector<std::uint8_t> fixtures();

  void set_serial(const std::string& serial);
  /// Major number of the firmware: 1 plain DMX, 2 RDM, 3 sniffer.
  void set_firmware(std::uint8_t major);
  /// Whether it knows the extension with the names of manufacturer and device; ENTTEC's own do not.
  void set_names(const std::string& manufacturer, const std::string& device);
  /// Tells of DMX that comes in, unasked, as in the direction input.
  void send_received_dmx();

  enum class Spoil { missing, garbage, late, duplicate, two_of_three };
  /// The next so many answers: kept back; other bytes in their place; kept back until the next answer, in
  /// front of which they then come; twice; two of three kept back.
  void spoil(Spoil how, int answers);

  /// Unplugged, as a power cycle: nothing is put out any more.
  void cut();
  void restore();
  /// Power on again in the same socket: nothing is put out, no spoilt answers.
  void power_cycle();
  /// Bytes straight into the widget, as from another program.
  void feed(std::string_view bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rig::sim::wire
