// rig-sim-tic: a simulated Pololu Tic, plugged into this machine's USB through the kernel's virtual host
// controller, or at a Unix socket. For tests; not installed. Orders come as lines on standard
// input, and each is answered with a line.
#include <chrono>
#include <cstdio>
#include <exception>
#include <map>

#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "sim/wire/control_socket.h"
#include "sim/wire/order_lines.h"
#include "sim/wire/tic.h"
#include "sim/wire/tic_orders.h"
#include "sim/wire/vhci.h"

namespace {

using namespace rig;
using namespace rig::sim::wire;

constexpr const char* kProgram = "rig-sim-tic";

struct Options {
  TicWorld world;
  TicSettingBytes settings = tic_factory_settings();
  std::string socket;
};

// What the Tic hangs on: the USB of this machine, or a socket.
class Place {
 public:
  Place(Tic& tic, std::string socket) : tic_(tic), path_(std::move(socket)) {}

  base::Result<void> plug() {
    if (socket_ || vhci_) return {};
    const auto handler = [this](const SetupPacket& setup, std::span<const std::uint8_t> out) {
      return tic_.control(setup, out);
    };
    if (!path_.empty()) {
      socket_ = std::make_unique<ControlSocket>(path_, handler);
      return {};
    }
    auto plugged = VhciPlug::plug_in(handler, UsbSpeed::full);
    if (!plugged) return base::pass(plugged);
    vhci_ = std::move(*plugged);
    return {};
  }
  void unplug() {
    socket_.reset();
    vhci_.reset();
  }

 private:
  Tic& tic_;
  const std::string path_;
  std::unique_ptr<ControlSocket> socket_;
  std::unique_ptr<VhciPlug> vhci_;
};

int run(int argc, char** argv) {
  CLI::App app("A simulated Pololu Tic on this machine's USB (needs root and the kernel module vhci-hcd).");
  Options options;
  std::vector<std::string> settings;
  const std::map<std::string, TicProduct> products{{"T825", TicProduct::t825}, {"T834", TicProduct::t834},
                                                   {"T500", TicProduct::t500}, {"N825", TicProduct::n825},
                                                   {"T249", TicProduct::t249}, {"36v4", TicProduct::v36}};
  app.add_option("--product", options.world.product, "T825 (default), T834, T500, N825, T249, 36v4")
      ->transform(CLI::CheckedTransformer(products));
  app.add_option("--serial", options.world.serial, "serial number")->capture_default_str();
  app.add_option("--socket", options.socket, "serve at this Unix socket in place of USB");
  app.add_option("--set", settings, "a byte of the settings, as in 0x41=3; may be repeated");
  app.add_option("--reverse-switch", options.world.reverse_switch_at, "microsteps from power-up")
      ->capture_default_str();
  app.add_option("--forward-switch", options.world.forward_switch_at, "microsteps from power-up")
      ->capture_default_str();
  app.add_option("--reverse-stop", options.world.reverse_stop_at, "microsteps from power-up")
      ->capture_default_str();
  app.add_option("--forward-stop", options.world.forward_stop_at, "microsteps from power-up")
      ->capture_default_str();
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  for (const std::string& each : settings) {
    if (const auto done = change_setting(options.settings, each); !done) {
      complain_of(kProgram, done.error());
      return 1;
    }
  }
  base::catch_interrupts();
  Tic tic(options.world, options.settings);
  Place place(tic, options.socket);
  return serve_order_lines({kProgram, [&] { return place.plug(); }, [&] { place.unplug(); },
                            [&](const std::string& order) { return carry_out_order(tic, order); }});
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // a socket that cannot be made
    std::fprintf(stderr, "%s: %s\n", kProgram, error.what());
    return 1;
  }
}
