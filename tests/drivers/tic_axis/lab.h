// A Tic on a socket, and the text of a rig.toml that finds it there.
#pragma once

#include <memory>
#include <string>

#include "sim/wire/control_socket.h"
#include "sim/wire/tic.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::tic::test {

/// As a lab would set it up: eighths of a step, 1472 mA, limit switches at both ends.
inline sim::wire::TicSettingBytes lab_settings() {
  sim::wire::TicSettingBytes s = sim::wire::tic_factory_settings();
  s[0x41] = 3;         // eighths
  s[0x40] = 46;        // of 32 mA
  s[0x5F] = 1U << 3U;  // forward limit switch: RX
  s[0x60] = 1U << 2U;  // reverse limit switch: TX
  s[0x5D] = 1U << 0U;  // kill switch: SCL
  const auto put = [&s](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) s[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  };
  put(0x4F, 400'000);     // acceleration: 4000 microsteps/s^2
  put(0x61, 50'000'000);  // homing, towards: 5000 microsteps/s
  put(0x65, 2'000'000);   // homing, away: 200 microsteps/s
  return s;
}

/// A table of rig.toml. 40 microsteps a degree; the switches of TicWorld lie at -62.5 and 62.5 degrees from
/// where the motor stands at power-up, which is 0 degrees once it is homed on the reverse one.
inline std::string lab_table(const std::string& serial, const std::string& transport,
                             const std::string& axis = "arm", const std::string& more = "",
                             const std::string& homing = "homing = \"reverse\"") {
  return fmt::format(R"([axis.{}]
serial = "{}"
transport = "{}"
counts_per_deg = 40.0
zero_deg = -62.5
max_velocity_deg_s = 125.0
max_acceleration_deg_s2 = 500.0
step_mode = 8
current_limit_ma = 1472
{}
{}
)",
                     axis, serial, transport, homing, more);
}

/// The Tic of the lab, plugged into a socket of its own.
class LabTic {
 public:
  explicit LabTic(const sim::wire::TicWorld& world = {},
                  const sim::wire::TicSettingBytes& settings = lab_settings())
      : tic(world, settings),
        socket(folder / "usb", [this](const auto& setup, auto out) { return tic.control(setup, out); }) {}

  [[nodiscard]] std::string table(const std::string& axis = "arm", const std::string& more = "",
                                  const std::string& homing = "homing = \"reverse\"") const {
    return lab_table(serial, "unix:" + socket.path().string(), axis, more, homing);
  }

  rig::test::TemporaryFolder folder;
  std::string serial = "00123456";
  sim::wire::Tic tic;
  sim::wire::ControlSocket socket;
};

}  // namespace rig::drivers::tic::test
