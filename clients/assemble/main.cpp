#include <cstdio>

#include "clients/assemble/assemble.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"

int main(int argc, char** argv) {
  using namespace rig;
  CLI::App app(
      "Turns a registered scan into an observation map: for every texel of the sample its reflectance in "
      "every\n"
      "pose, with variance and validity (HDF5). Run rig-calibrate first.\n"
      "Exit status: 0 done, 1 on an error, 2 for wrong usage, 130 when interrupted.",
      "rig-assemble");
  assemble::AssembleOptions options;
  app.add_option("scan", options.scan, "Folder of the scan")->required()->type_name("SCAN");
  app.add_option("--texels", options.columns, "Texels along x of the sample")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option("--out", options.out, "The map; SCAN/observation.h5 if not given")->type_name("FILE");
  app.add_option("--memory-mib", options.memory_mib,
                 "Memory to stay within; less than the map needs means more passes over the frames")
      ->check(CLI::Range(1, 1 << 24))
      ->capture_default_str();
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  if (options.out.empty()) options.out = options.scan / "observation.h5";
  for (int i = 0; i < argc; ++i) options.command += (i > 0 ? " " : "") + std::string(argv[i]);

  base::catch_interrupts();
  const auto summary = assemble::assemble_scan(options);
  if (!summary) {
    std::fprintf(stderr, "rig-assemble: %s\n", summary.error().text().c_str());
    return summary.error().code == base::ErrorCode::interrupted ? 130 : 1;
  }
  std::fputs(summary->text().c_str(), stdout);
  std::printf("%s\n", options.out.string().c_str());
  return 0;
}
