// rig-sim-uvc: a simulated USB video camera on this machine's USB, through the kernel's virtual host
// controller. For tests; not installed. Orders come as lines on standard input, and each is answered with a
// line.
#include <cstdio>

#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "sim/wire/order_lines.h"
#include "sim/wire/uvc_orders.h"
#include "sim/wire/uvc_plug.h"

namespace {

using namespace rig;
using namespace rig::sim::wire;

int complain(const base::Error& error) {
  std::fprintf(stderr, "rig-sim-uvc: %s\n", error.text().c_str());
  return 1;
}

void obey(UvcCamera& camera, UvcPlug& plug, const std::string& line) {
  base::Result<std::string> said;
  if (line == "unplug") {
    plug.unplug();
  } else if (line == "plug") {
    if (auto done = plug.plug(); !done) said = base::pass(done);
  } else {
    said = carry_out_order(camera, line);
  }
  if (!said) complain(said.error());
  std::printf("%s\n", !said ? "refused" : said->empty() ? "ok" : said->c_str());
  std::fflush(stdout);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): what is thrown here is a bug and shall end the program as one.
int main(int argc, char** argv) {
  CLI::App app(
      "A simulated USB video camera on this machine's USB (needs root and the kernel module vhci-hcd).");
  std::string serial = "00000001";
  int delay = 1;
  app.add_option("--serial", serial, "serial number")->capture_default_str();
  app.add_option("--delay", delay, "frames until a setting is in one")->capture_default_str();
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  base::catch_interrupts();
  UvcCamera camera(serial, delay);
  UvcPlug plug(camera);
  if (const auto plugged = plug.plug(); !plugged) return complain(plugged.error());
  std::printf("ready\n");
  std::fflush(stdout);
  serve_order_lines([&](const std::string& line) { obey(camera, plug, line); });
  return 0;
}
