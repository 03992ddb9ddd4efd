// rig-sim-cp2112: a simulated CP2112 on this machine's USB, through the kernel's virtual host controller. For
// tests; not installed. Orders come as lines on standard input, and each is answered with a line.
#include <memory>

#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "sim/wire/cp2112_orders.h"
#include "sim/wire/order_lines.h"
#include "sim/wire/vhci.h"

namespace {

using namespace rig;
using namespace rig::sim::wire;

class Socket {
 public:
  explicit Socket(Cp2112& chip) : chip_(chip) {}

  base::Result<void> plug() {
    if (plugged_) return {};
    chip_.power_cycle();
    auto plugged =
        VhciPlug::plug_in([this](const SetupPacket& setup,
                                 std::span<const std::uint8_t> out) { return chip_.control(setup, out); },
                          UsbSpeed::full);
    if (!plugged) return base::pass(plugged);
    plugged_ = std::move(*plugged);
    return {};
  }
  void unplug() { plugged_.reset(); }

 private:
  Cp2112& chip_;
  std::unique_ptr<VhciPlug> plugged_;
};

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): what is thrown here is a bug and shall end the program as one.
int main(int argc, char** argv) {
  CLI::App app("A simulated CP2112 on this machine's USB (needs root and the kernel module vhci-hcd).");
  std::string serial = "00801234";
  app.add_option("--serial", serial, "serial number")->capture_default_str();
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  base::catch_interrupts();
  Cp2112 chip(serial);
  Socket socket(chip);
  return serve_order_lines({"rig-sim-cp2112", [&] { return socket.plug(); }, [&] { socket.unplug(); },
                            [&](const std::string& order) { return carry_out_order(chip, order); }});
}
