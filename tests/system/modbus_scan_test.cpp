// A whole scan with four Modbus drives on one line, a camera on GigE Vision and a light at a DMX widget.
#include <gtest/gtest.h>

#include "sim/wire/dmx_pro.h"
#include "sim/wire/gv_camera_process.h"
#include "sim/wire/gv_pattern.h"
#include "sim/wire/modbus_leadshine.h"
#include "sim/wire/modbus_line.h"
#include "sim/wire/modbus_oriental.h"
#include "sim/wire/own_network.h"
#include "tests/system/gige_part.h"
#include "tests/system/real_rig.h"

namespace rig::test {
namespace {

using sim::wire::LeadshineDrive;
using sim::wire::OrientalDrive;
using std::chrono::milliseconds;

// 100 counts a degree, and ends of travel beyond every limit of rig.toml.
constexpr const char* kDrive = R"(
[settings.axis.{}]
slave = {}
profile = "{}/share/drives/{}.toml"
counts_per_deg = 100
zero_deg = {}
max_velocity_deg_s = 60
max_acceleration_deg_s2 = 120
)";

std::string drive(const char* axis, int slave, const char* profile, double zero_deg) {
  return fmt::format(fmt::runtime(kDrive), axis, slave, RIG_SOURCE_DIR, profile, zero_deg);
}

TEST(ModbusScan, WithAGigECameraAndADmxLight) {
  ASSERT_TRUE(sim::wire::enter_own_network()) << "needs a network of its own, as root has it";
  const TemporaryFolder folder;
  const LeadshineDrive::Setup leadshine{0, {-18600, 18600}, milliseconds(5)};
  const OrientalDrive::Setup oriental{0, {-18600, 18600}, milliseconds(5), false};
  LeadshineDrive roll(leadshine), tilt(leadshine);
  OrientalDrive pan(oriental), arm(oriental);
  const auto line = sim::wire::make_rtu_line(folder / "modbus", std::chrono::microseconds(1750),
                                             {{1, &roll}, {2, &tilt}, {3, &pan}, {4, &arm}});
  sim::wire::DmxPro widget(folder / "dmx", "02301234");
  const GigePart camera;

  RealRigToml toml;
  toml.module("drives", "modbus_axis",
              // A busy machine may keep the simulated drives waiting.
              fmt::format("port = \"{}\"\nbaud = 115200\nparity = \"none\"\nanswer_ms = 260\ncall_ms = 900\n",
                          (folder / "modbus").string()) +
                  drive("roll", 1, "leadshine_pr", 0) + drive("tilt", 2, "leadshine_pr", 0) +
                  drive("pan", 3, "oriental_az", 0) + drive("arm", 4, "oriental_az", 45));
  for (const std::string axis : {"roll", "tilt", "pan", "arm"}) toml.part("axis." + axis, "drives", axis);
  toml.module(
      "lamp", "dmx_light",
      fmt::format("port = \"{}\"\nserial = \"02301234\"\nchannel = 1\n[settings.shutter]\nchannel = 3\n",
                  (folder / "dmx").string()));
  toml.part("light", "lamp", "light");
  camera.put_into(toml);

  constexpr int kPoses = 4;
  const auto frames = scanned_frames(folder / "rig", toml.text(), kPoses);
  GigePart::expect_own_exposures(frames);
  EXPECT_EQ(line->unreadable(), 0);
  // The last pose of the job, at the drives.
  EXPECT_NEAR(roll.position(), -100 * 33, 1);
  EXPECT_NEAR(arm.position(), 100 * (95 - 17 - 45), 1);
}

}  // namespace
}  // namespace rig::test
