#include "clients/rig/setup_options.h"

#include <memory>

#include "clients/rig/axis_setup.h"
#include "clients/rig/live.h"

namespace rig::client {

void offer_live(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen) {
  const auto given = std::make_shared<LiveOptions>();
  auto* live_command =
      command(app, "live", "photographs again and again, with focus and exposure in figures");
  live_command->add_option("--exposure-ms", given->exposure_ms, "exposure time, of the first one with --auto")
      ->capture_default_str();
  live_command->add_flag("--auto", given->automatic,
                         "adjust the exposure: the brightest at 70 % of full scale");
  live_command->add_flag("--once", given->once, "print one set of figures, a line each, and end");
  live_command->add_option("--save", given->save, "the last frame. .png: a preview; .tif: the raw samples");
  live_command
      ->add_option("--config", given->config, "rig.toml, for levels, sample and fiducials; not needed")
      ->capture_default_str();
  live_command->add_option("--preview-width", given->preview_width,
                           "measure on a picture of so many pixels a row, for slow networks; 0: on the raw "
                           "frame. Default: 0, over "
                           "the network 1200");
  live_command->callback([&chosen, &to, given] { chosen = [&to, given] { return live(to, *given); }; });
}

void offer_axis(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen) {
  const auto given = std::make_shared<AxisSetupOptions>();
  given->config = kInstalledRigToml;
  auto* axis = app.add_subcommand("axis", "one axis of the rig");
  axis->require_subcommand(1);
  auto* setup =
      command(*axis, "setup", "find direction, scale, limits and home with a person beside the rig");
  setup->add_option("axis", given->axis, "roll, tilt, pan or arm")->required();
  setup->add_option("--config", given->config, "the rig.toml that rigd was started with")
      ->capture_default_str();
  setup->add_option("--jog-deg", given->jog_deg, "how far it moves to show its direction")
      ->capture_default_str();
  setup->add_option("--scale-deg", given->scale_deg, "how far it turns to be measured")
      ->capture_default_str();
  setup->add_option("--step-deg", given->step_deg, "steps towards the ends")->capture_default_str();
  setup->callback([&chosen, &to, given] { chosen = [&to, given] { return axis_setup(to, *given); }; });
}

}  // namespace rig::client
