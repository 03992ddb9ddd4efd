// rig-sim-canopen: simulated drives on a CAN interface, or on a bus of their own behind a unix socket.
#include <cstdio>
#include <ctime>
#include <exception>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <poll.h>
#include <unistd.h>

#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "sim/wire/can_hub.h"
#include "sim/wire/canopen_console.h"

namespace {

using namespace rig::sim::wire;  // NOLINT(google-build-using-namespace): this program is about nothing else

struct Options {
  std::string interface, socket, control, log;
  std::vector<int> nodes{1};
  double low_switch = -50000, high_switch = 50000;
};

// As candump -L writes them.
void write_frame(std::FILE* log, const std::string& where, const can_frame& frame) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  std::fprintf(log, "(%lld.%06ld) %s %03X#", static_cast<long long>(now.tv_sec), now.tv_nsec / 1000,
               where.c_str(), frame.can_id & CAN_SFF_MASK);
  for (int i = 0; i < frame.can_dlc; ++i) std::fprintf(log, "%02X", frame.data[i]);
  std::fputc('\n', log);
  std::fflush(log);
}

// A FIFO is opened for writing too, so that it stays open when whoever wrote to it leaves.
int open_control(const std::string& path) {
  if (path.empty()) return STDIN_FILENO;
  const int fd = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), path);
  return fd;
}

void obey_until_the_end(CanopenStation& station, int control) {
  std::string line;
  while (!rig::base::interrupted()) {
    pollfd wait{control, POLLIN, 0};
    constexpr int kLookForASignal_ms = 200;
    if (::poll(&wait, 1, kLookForASignal_ms) <= 0) continue;
    char c = 0;
    const ssize_t n = ::read(control, &c, 1);
    if (n < 0) continue;
    // The end of standard input ends nothing: a program in the background has none.
    if (n == 0) {
      (void)::poll(nullptr, 0, kLookForASignal_ms);
      continue;
    }
    if (c != '\n') {
      line += c;
      continue;
    }
    std::printf("%s\n", obey(station, line).c_str());
    std::fflush(stdout);
    line.clear();
  }
}

void serve(const Options& options) {
  std::unique_ptr<CanHub> hub;
  int fd = -1;
  if (options.socket.empty()) {
    fd = open_can_interface(options.interface);
  } else {
    hub = std::make_unique<CanHub>(options.socket);
    fd = hub->attach();
  }
  std::vector<CanopenNode::Settings> nodes;
  for (const int id : options.nodes) {
    CanopenNode::Settings settings;
    settings.id = id;
    settings.drive.low_switch = options.low_switch;
    settings.drive.high_switch = options.high_switch;
    settings.drive.low_stop = options.low_switch - 10000;
    settings.drive.high_stop = options.high_switch + 10000;
    nodes.push_back(settings);
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> log(
      options.log.empty() ? nullptr : std::fopen(options.log.c_str(), "a"), &std::fclose);
  if (!options.log.empty() && log == nullptr)
    throw std::system_error(errno, std::generic_category(), options.log);
  const int control = open_control(options.control);
  CanopenStation station(fd, nodes);
  if (log != nullptr) {
    const std::string where = options.socket.empty() ? options.interface : "unix";
    station.listen([file = log.get(), where](const can_frame& frame) { write_frame(file, where, frame); });
  }
  std::printf("ready\n");
  std::fflush(stdout);
  obey_until_the_end(station, control);
  station.listen({});
  if (control != STDIN_FILENO) ::close(control);
}

int run(int argc, char** argv) {
  CLI::App app("Simulated CANopen drives (CiA 402) for tests of the driver cia402_axis.");
  app.footer(std::string(
                 "Orders, a line each, on standard input or a FIFO; each is answered on standard output:\n") +
             canopen_orders());
  Options options;
  auto* interface = app.add_option("--interface", options.interface, "CAN interface to be on");
  auto* socket =
      app.add_option("--socket", options.socket, "unix socket to serve a bus at (interface = \"unix:PATH\")");
  interface->excludes(socket);
  app.add_option("--node", options.nodes, "node numbers")->check(CLI::Range(1, 127))->capture_default_str();
  app.add_option("--low", options.low_switch, "low limit switch, counts")->capture_default_str();
  app.add_option("--high", options.high_switch, "high limit switch, counts")->capture_default_str();
  app.add_option("--control", options.control, "FIFO that orders are read from");
  app.add_option("--log", options.log, "file that every frame is added to, as candump -L writes it");
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  if (options.interface.empty() == options.socket.empty()) {
    std::fprintf(stderr, "rig-sim-canopen: give one of --interface and --socket\n");
    return rig::base::kWrongUsage;
  }
  rig::base::catch_interrupts();
  serve(options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "rig-sim-canopen: %s\n", error.what());
    return 1;
  }
}
