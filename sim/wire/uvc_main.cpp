// rig-sim-uvc: a simulated USB video camera on this machine's USB, through the kernel's virtual host
// controller. For tests; not installed. Orders come as lines on standard input, and each is answered with a
// line.
#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "sim/wire/order_lines.h"
#include "sim/wire/uvc_orders.h"
#include "sim/wire/uvc_plug.h"

using namespace rig;
using namespace rig::sim::wire;

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
  return serve_order_lines({"rig-sim-uvc", [&] { return plug.plug(); }, [&] { plug.unplug(); },
                            [&](const std::string& order) { return carry_out_order(camera, order); }});
}
