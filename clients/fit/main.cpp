// rig-fit: an observation map becomes a parameter map.
#include <cstdio>

#include "clients/fit/fit_map.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"

int main(int argc, char** argv) {
  CLI::App app("Fits a reflectance model to every texel of an observation map.");
  rig::fit::Options options;
  app.add_option("observation", options.observation, "observation map (.h5)")->required();
  app.add_option("--out", options.out, "parameter map to write (.exr)")->required();
  app.add_option("--model", options.model, "diffuse, or diffuse with one Lafortune lobe")
      ->check(CLI::IsMember({"lafortune", "diffuse"}))
      ->capture_default_str();
  app.add_option("--leave-out", options.leave_out, "hold every so manieth pose out of the fit; 0: none")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  if (const auto status = rig::base::parse_command_line(app, argc, argv)) return *status;
  rig::base::catch_interrupts();
  if (const auto done = rig::fit::fit_map(options); !done) {
    std::fprintf(stderr, "rig-fit: %s\n", done.error().text().c_str());
    return done.error().code == rig::base::ErrorCode::interrupted ? 130 : 1;
  }
  std::printf("written to %s\n", options.out.c_str());
  return 0;
}
