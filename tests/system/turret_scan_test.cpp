// A whole scan on the rig of McAllister 2002: pan and tilt of one pan-tilt unit, roll and light arm on a 6000
// controller, and a camera on GigE Vision. The light is a relay on a line of a board.
#include <gtest/gtest.h>

#include "sim/wire/line_board.h"
#include "sim/wire/own_network.h"
#include "sim/wire/ptu.h"
#include "sim/wire/sixk.h"
#include "tests/system/gige_part.h"
#include "tests/system/real_rig.h"

namespace rig::test {
namespace {

using sim::wire::Ptu;
using sim::wire::Sixk;

TEST(TurretScan, WithA6000ControllerAGigECameraAndARelay) {
  ASSERT_TRUE(sim::wire::enter_own_network()) << "needs a network of its own, as root has it";
  const TemporaryFolder folder;
  Ptu::Setup turret;
  turret.link = folder / "ptu";
  Ptu unit(turret);
  Sixk::Setup controller;
  controller.link = folder / "sixk";
  Sixk sixk(controller);
  sim::wire::LineBoard board(folder / "lines", {"lamp", "shutter"});
  const GigePart camera;

  RealRigToml toml;
  toml.module("turret", "ptu_axis",
              fmt::format(R"(port = "{}"
[settings.axis.pan]
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 120.0
[settings.axis.tilt]
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 120.0
)",
                          unit.path().string()));
  toml.module("parker", "sixk_axis",
              fmt::format(R"(port = "{}"
[settings.axis.roll]
number = 1
counts_per_deg = 250
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 120.0
home_velocity_deg_s = 20.0
[settings.axis.arm]
number = 2
counts_per_deg = 200
zero_deg = 45.0
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 240.0
home_velocity_deg_s = 10.0
)",
                          sixk.path().string()));
  toml.module("board", "gpiod_lines",
              fmt::format(R"(chip = "unix:{}"
[settings.output.lamp]
line = "lamp"
[settings.output.shutter]
line = "shutter"
[settings.light]
relay = "lamp"
shutter = "shutter"
)",
                          board.path().string()));
  // Positions of the unit are 0.051 degrees apart, and its tilt has no more room.
  toml.part("axis.pan", "turret", "pan").set_in("axis.pan", "tolerance_deg", "0.06");
  toml.part("axis.tilt", "turret", "tilt")
      .set_in("axis.tilt", "tolerance_deg", "0.06")
      .set_in("axis.tilt", "min_deg", "-45.0")
      .set_in("axis.tilt", "max_deg", "30.0");
  toml.part("axis.roll", "parker", "roll");
  toml.part("axis.arm", "parker", "arm").set_in("axis.arm", "tolerance_deg", "0.01");
  toml.part("light", "board", "light");
  camera.put_into(toml);

  constexpr int kPoses = 4;
  const auto frames = scanned_frames(folder / "rig", toml.text(), kPoses);
  GigePart::expect_own_exposures(frames);
  // The last pose of the job, at the devices.
  EXPECT_NEAR(unit.position(Ptu::pan), -34 * 3600 / 185.1428, 1);
  EXPECT_NEAR(unit.position(Ptu::tilt), -15 * 3600 / 185.1428, 1);
  EXPECT_NEAR(sixk.position(1), -33 * 250, 1);
  EXPECT_NEAR(sixk.position(2), (95 - 17 - 45) * 200, 1);
  EXPECT_FALSE(board.high(0)) << "the lamp is off when rigd has ended";
}

}  // namespace
}  // namespace rig::test
