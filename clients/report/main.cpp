// rig-report: one HTML page about a scan and what was fitted to it.
#include <cstdio>

#include "clients/report/page.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"

int main(int argc, char** argv) {
  CLI::App app("Writes one self-contained HTML page: parameters, views photographed and rendered, numbers.");
  rig::report::Options options;
  bool require = false;
  app.add_option("observation", options.observation, "observation map (.h5)")->required();
  app.add_option("--map", options.maps, "parameter map (.exr); more than one are compared")->required();
  app.add_option("--truth", options.truth, "what the virtual rig knows (rig virtual-truth)");
  app.add_option("--views", options.views, "views shown as pictures")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--out", options.out, "page to write (.html)")->required();
  app.add_flag("--require", require, "exit status 1 if a figure misses its limit");
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  rig::base::catch_interrupts();
  const auto figures = rig::report::write_report(options);
  if (!figures) {
    std::fprintf(stderr, "rig-report: %s\n", figures.error().text().c_str());
    return figures.error().code == rig::base::ErrorCode::interrupted ? 130 : 1;
  }
  bool all = true;
  for (const auto& f : *figures) {
    std::printf("figure: %s = %.4f (%s %g) %s\n", f.name.c_str(), f.value,
                f.at_least ? "at least" : "at most", f.limit, f.met() ? "ok" : "missed");
    all = all && f.met();
  }
  std::printf("written to %s\n", options.out.c_str());
  return require && !all ? 1 : 0;
}
