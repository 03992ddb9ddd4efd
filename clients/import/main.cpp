// rig-import: photographs with known camera and light positions become an observation map.
#include <cstdio>

#include "clients/import/import.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"

namespace {

using namespace rig;

struct Arguments {
  std::string stack;
  std::string encoding;
  double unit_mm = 10;
  double width_mm = 0;
  double camera_distance_mm = 0;
  import::ImportOptions options;
};

base::Result<import::Stack> read_stack(const Arguments& a) {
  const auto found = import::find_layout(a.stack);
  if (!found) return base::pass(found);
  if (found->layout == import::Layout::positions) {
    auto stack = import::read_positions_layout(found->path, a.unit_mm * 1e-3);
    if (stack && a.width_mm > 0) stack->width_m = a.width_mm * 1e-3;
    return stack;
  }
  if (!(a.width_mm > 0)) {
    return base::fail(base::ErrorCode::bad_input, "an .lp file does not say how wide the sample is", a.stack,
                      "give --width-mm");
  }
  // Far enough that the direction of view hardly changes over the sample, as these domes are used.
  const double distance_mm = a.camera_distance_mm > 0 ? a.camera_distance_mm : 10 * a.width_mm;
  auto stack = import::read_lp_layout(found->path, distance_mm * 1e-3);
  if (stack) stack->width_m = a.width_mm * 1e-3;
  return stack;
}

base::Result<import::ImportSummary> run(Arguments& a) {
  auto stack = read_stack(a);
  if (!stack) return base::pass(stack);
  if (a.encoding.empty()) {
    const auto size = import::image_size(stack->photographs.front().file);
    if (!size) return base::pass(size);
    a.encoding = size->bits == 8 ? "srgb" : "linear";
    std::fprintf(stderr, "rig-import: %d-bit photographs are taken as %s; --encoding says otherwise\n",
                 size->bits, a.encoding.c_str());
  }
  const auto encoding = import::parse_encoding(a.encoding);
  if (!encoding) return base::pass(encoding);
  a.options.encoding = *encoding;
  return import::import_stack(*stack, a.options);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Turns rectified photographs of a flat sample, with known camera and light positions, into an\n"
      "observation map. Layouts: a folder with camera_pos.txt, light_pos.txt, light_power.txt, "
      "image_size.txt\n"
      "and images in the order of their names; or reflectance transformation imaging (images and an .lp "
      "file).\n"
      "Exit status: 0 done, 1 on an error, 2 for wrong usage, 130 when interrupted.",
      "rig-import");
  Arguments a;
  app.add_option("stack", a.stack, "Folder, or .lp file")->required()->type_name("PATH");
  app.add_option("--out", a.options.out, "Observation map to write (.h5)")->required()->type_name("FILE");
  app.add_option("--name", a.options.name, "Name of the sample; the folder's name if not given");
  app.add_option("--texels", a.options.columns, "Texels along x; one a pixel if not given")
      ->check(CLI::Range(1, 65536));
  app.add_option("--encoding", a.encoding,
                 "linear, srgb or gamma:EXPONENT; if not given, srgb for 8 bits and linear for more");
  app.add_option("--unit-mm", a.unit_mm, "Length that the position files count in")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  app.add_option("--width-mm", a.width_mm, "Width of the sample, needed for .lp")
      ->check(CLI::Range(1e-3, 1e6));
  app.add_option("--camera-distance-mm", a.camera_distance_mm,
                 "Distance of the camera for .lp; ten times the width if not given")
      ->check(CLI::Range(1e-3, 1e9));
  app.add_option("--noise", a.options.photograph_noise,
                 "Relative standard deviation of a value beyond its rounding")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--memory-mib", a.options.memory_mib, "Memory for the values under work")
      ->check(CLI::Range(1, 1 << 24))
      ->capture_default_str();
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  for (int i = 0; i < argc; ++i) a.options.command += (i > 0 ? " " : "") + std::string(argv[i]);
  if (a.options.name.empty()) {
    const auto path = std::filesystem::weakly_canonical(a.stack);
    a.options.name = path.stem().string();
  }
  base::catch_interrupts();
  const auto summary = run(a);
  if (!summary) {
    std::fprintf(stderr, "rig-import: %s\n", summary.error().text().c_str());
    return summary.error().code == base::ErrorCode::interrupted ? 130 : 1;
  }
  std::fputs(summary->text().c_str(), stdout);
  std::printf("%s\n", a.options.out.string().c_str());
  return 0;
}
