#include <cstdio>

#include "clients/calibrate/calibrate.h"
#include "core/base/command_line.h"
#include "core/base/interrupt.h"
#include "core/base/units.h"

int main(int argc, char** argv) {
  using namespace rig;
  CLI::App app(
      "Finds the carrier's fiducials in every pose of a scan, solves where the carrier stood, and writes\n"
      "SCAN/registration.toml. Poses that cannot be registered are listed there and left out by "
      "rig-assemble.\n"
      "Exit status: 0 if any pose is registered, 1 if none or on an error, 2 for wrong usage, 130 when "
      "interrupted.",
      "rig-calibrate");
  std::string scan;
  calibration::RegistrationLimits limits;
  double turn_deg = base::degrees(limits.most_turn_rad);
  double shift_mm = base::mm_from_metres(limits.most_shift_m);
  app.add_option("scan", scan, "Folder of the scan")->required()->type_name("SCAN");
  app.add_option("--least-tags", limits.least_tags, "Fewer tags than this reject a pose")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  app.add_option("--most-rms-px", limits.most_rms_px, "A larger residual of the tags rejects a pose")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--most-turn-deg", turn_deg, "Farther from the nominal orientation rejects a pose")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--most-shift-mm", shift_mm, "Farther from the nominal place rejects a pose")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  limits.most_turn_rad = base::radians(turn_deg);
  limits.most_shift_m = base::metres_from_mm(shift_mm);

  base::catch_interrupts();
  const auto summary = calibrate::calibrate_scan(scan, limits);
  if (!summary) {
    std::fprintf(stderr, "rig-calibrate: %s\n", summary.error().text().c_str());
    return summary.error().code == base::ErrorCode::interrupted ? 130 : 1;
  }
  std::fputs(summary->text().c_str(), stdout);
  if (summary->registered() == 0) {
    std::fprintf(stderr, "rig-calibrate: %s: no pose could be registered\n", scan.c_str());
    return 1;
  }
  return 0;
}
