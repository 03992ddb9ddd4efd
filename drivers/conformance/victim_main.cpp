// A module at work, to be killed by a check of the conformance suite:
//   conformance_victim MODULE SETTINGS-FILE STATE-FOLDER DEVICE TASK...
// Says "under way" on standard output once the task is, or what went wrong, and then asks for the device's
// state until it is killed. It never closes the module.
#include <csignal>
#include <cstdio>
#include <string>
#include <sys/prctl.h>
#include <thread>
#include <vector>

#include "core/base/files.h"
#include "drivers/conformance/module_under_test.h"

namespace {

using namespace rig;

base::Result<void> work(const std::vector<std::string>& words) {
  const auto task = drivers::conformance::task_of(std::span(words).subspan(3));
  if (!task) return base::pass(task);
  const auto settings = base::read_file(words[1]);
  if (!settings) return base::pass(settings);
  const auto clock = base::make_system_clock();
  auto devices = drivers::conformance::open_module({words[0], *settings, words[2]}, *clock);
  if (!devices) return base::pass(devices);
  if (auto begun = drivers::conformance::start(*task, *devices, *clock); !begun) return begun;
  std::puts("under way");
  std::fflush(stdout);
  while (true) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    drivers::conformance::look_at(*task, *devices);
  }
}

}  // namespace

int main(int argc, char** argv) {
  // Nobody else would end it.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 4) {
    std::fprintf(stderr, "usage: conformance_victim MODULE SETTINGS-FILE STATE-FOLDER DEVICE TASK...\n");
    return 2;
  }
  const auto done = work(words);
  std::printf("%s\n", done.error().text().c_str());
  return 1;
}
