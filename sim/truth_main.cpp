// rig-virtual-truth: what the virtual rig knows, for the report and the tests alone.
#include <cstdio>

#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "sim/truth.h"

int main(int argc, char** argv) {
  CLI::App app("Writes the truth behind an observation map of the virtual rig.");
  rig::sim::TruthOptions options;
  app.add_option("--rig", options.rig, "rig.toml of the scan")->required();
  app.add_option("--like", options.like, "observation map whose poses and grid are taken")->required();
  app.add_option("--out", options.out, "observation map to write")->required();
  app.add_option("--every", options.every, "only every so manieth texel each way")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  rig::base::catch_interrupts();
  if (const auto done = rig::sim::write_truth(options); !done) {
    std::fprintf(stderr, "rig-virtual-truth: %s\n", done.error().text().c_str());
    return done.error().code == rig::base::ErrorCode::interrupted ? 130 : 1;
  }
  std::printf("written to %s\n", options.out.c_str());
  return 0;
}
