// rig-sim-gv-camera: the simulated GigE Vision camera as a process. Commands come as lines on standard input,
// and each is answered by a line: "ok", or "error" and why.
#include <cstdio>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "core/base/command_line.h"
#include "sim/wire/gv_camera.h"

namespace {

using rig::sim::wire::FrameFault;
using rig::sim::wire::GvCamera;

const std::map<std::string, FrameFault> kFaults{{"skip-number", FrameFault::skipped_number},
                                                {"cut-short", FrameFault::cut_short},
                                                {"other-format", FrameFault::other_format},
                                                {"other-exposure", FrameFault::other_exposure},
                                                {"packets-twice", FrameFault::packets_twice}};

// Empty: done.
std::string obey(GvCamera& camera, const std::string& line) {
  std::istringstream words(line);
  std::string command;
  double number = 0;
  words >> command;
  const bool has_number = static_cast<bool>(words >> number);
  if (command == "vanish") {
    camera.vanish();
  } else if (command == "return") {
    if (!camera.come_back()) return "its port is taken";
  } else if (command == "corrupt") {
    camera.corrupt_next();
  } else if (command == "drop") {
    camera.drop_next();
  } else if (command == "pulse") {
    if (!camera.pulse()) return "it does not wait for a pulse";
  } else if (command == "drop-control") {
    camera.drop_control();
  } else if (command == "lose" && has_number) {
    camera.lose(static_cast<int>(number));
  } else if (command == "delay" && has_number) {
    camera.delay_next(std::chrono::milliseconds(static_cast<int>(number)));
  } else if (command == "temperature" && has_number) {
    camera.set_temperature_c(number);
  } else if (command == "ready" && has_number) {
    camera.set_ready(number != 0);
  } else if (const auto fault = kFaults.find(command); fault != kFaults.end()) {
    camera.spoil_next(fault->second);
  } else {
    return "no such command";
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a GigE Vision camera. Commands on standard input: vanish, return, lose PER_THOUSAND, "
      "corrupt, drop, pulse, temperature CELSIUS, ready 0|1, drop-control; with packets of its "
      "own also skip-number, cut-short, other-format, other-exposure, packets-twice, delay MS, of the next "
      "frame.");
  rig::sim::wire::GvCameraOptions options;
  int lost = 0;
  bool ramp = false;
  app.add_option("--interface", options.interface, "address or name of the network interface")
      ->capture_default_str();
  app.add_option("--serial", options.serial, "serial number")->capture_default_str();
  app.add_option("--lost", lost, "so many packets in a thousand never arrive")->capture_default_str();
  app.add_option("--trigger-hz", options.trigger_hz, "a triggered frame begins at the next beat of this")
      ->capture_default_str();
  app.add_flag("--exposes", options.exposes, "a frame takes its exposure time, up to 0.3 s");
  app.add_flag("--ramp", ramp, "Aravis' own ramp instead of a pattern that tells exposure and frame");
  app.add_flag("--own-packets", options.own_packets,
               "it sends the packets itself, with chunks where they are asked for");
  app.add_flag("--resend", options.resends,
               "it keeps its packets and sends those again that are asked for (needs CAP_NET_RAW)")
      ->needs("--own-packets");
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  options.paints = !ramp;
  GvCamera camera(options);
  if (!camera.is_running()) {
    std::fprintf(stderr, "rig-sim-gv-camera: %s: no such interface, or its port 3956 is taken%s\n",
                 options.interface.c_str(), options.resends ? ", or it may not hear requests there" : "");
    return 1;
  }
  camera.lose(lost);
  std::cout << "ready" << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    const std::string error = obey(camera, line);
    std::cout << (error.empty() ? "ok" : "error: " + error) << std::endl;
  }
  return 0;
}
