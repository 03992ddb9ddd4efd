// A whole scan on the rig of McAllister 2002: pan and tilt of one pan-tilt unit, roll and light arm on a 6000
// controller, and a camera on GigE Vision, whose network may lose packets. The light is a relay on a line of
// a board.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include "sim/wire/line_board.h"
#include "sim/wire/own_network.h"
#include "sim/wire/ptu.h"
#include "sim/wire/sixk.h"
#include "tests/system/gige_part.h"
#include "tests/system/job_events.h"
#include "tests/system/real_rig.h"

namespace rig::test {
namespace {

using sim::wire::Ptu;
using sim::wire::Sixk;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr int kPoses = 4;

class TurretScan : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(sim::wire::enter_own_network()) << "needs a network of its own, as root has it";
    Ptu::Setup turret;
    turret.link = folder_ / "ptu";
    unit_.emplace(turret);
    Sixk::Setup controller;
    controller.link = folder_ / "sixk";
    sixk_.emplace(controller);
    board_.emplace(folder_ / "lines", std::vector<std::string>{"lamp", "shutter"});
  }

  // All but the camera.
  [[nodiscard]] RealRigToml toml() const {
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
                            unit_->path().string()));
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
                            sixk_->path().string()));
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
                            board_->path().string()));
    // Positions of the unit are 0.051 degrees apart, and its tilt has no more room.
    toml.part("axis.pan", "turret", "pan").set_in("axis.pan", "tolerance_deg", "0.06");
    toml.part("axis.tilt", "turret", "tilt")
        .set_in("axis.tilt", "tolerance_deg", "0.06")
        .set_in("axis.tilt", "min_deg", "-45.0")
        .set_in("axis.tilt", "max_deg", "30.0");
    toml.part("axis.roll", "parker", "roll");
    toml.part("axis.arm", "parker", "arm").set_in("axis.arm", "tolerance_deg", "0.01");
    toml.part("light", "board", "light");
    return toml;
  }

  [[nodiscard]] std::filesystem::path rig_folder() const { return folder_ / "rig"; }
  [[nodiscard]] std::vector<std::string> reasons() const { return reasons_in_journal(rig_folder() / "scan"); }
  [[nodiscard]] std::string log() const { return bytes_in(rig_folder() / "rigd.log"); }

  const TemporaryFolder folder_;
  std::optional<Ptu> unit_;
  std::optional<Sixk> sixk_;
  std::optional<sim::wire::LineBoard> board_;
};

TEST_F(TurretScan, WithA6000ControllerAGigECameraAndARelay) {
  const GigePart camera;
  RealRigToml toml = this->toml();
  camera.put_into(toml);
  const auto frames = scanned_frames(rig_folder(), toml.text(), kPoses);
  GigePart::expect_own_exposures(frames);
  // The last pose of the job, at the devices.
  EXPECT_NEAR(unit_->position(Ptu::pan), -34 * 3600 / 185.1428, 1);
  EXPECT_NEAR(unit_->position(Ptu::tilt), -15 * 3600 / 185.1428, 1);
  EXPECT_NEAR(sixk_->position(1), -33 * 250, 1);
  EXPECT_NEAR(sixk_->position(2), (95 - 17 - 45) * 200, 1);
  EXPECT_FALSE(board_->high(0)) << "the lamp is off when rigd has ended";
}

// Of 31 packets a frame 1 % never arrives, and nobody asks for them: every fourth frame is damaged.
TEST_F(TurretScan, PosesWhoseFramesLackPacketsAreTakenAgain) {
  const GigePart camera({"--own-packets", "--lost", "10"});
  RealRigToml toml = this->toml();
  camera.put_into(toml, "packet_resend = false\n");
  constexpr int kAttempts = 10;
  const auto frames = scanned_frames(rig_folder(), toml.text(), kPoses, kAttempts);
  GigePart::expect_own_exposures(frames);
  EXPECT_THAT(reasons(), Contains(HasSubstr("the frame is damaged: part of it never came"))) << log();
}

// Twice the loss, of a camera that keeps its packets.
TEST_F(TurretScan, PacketsThatTheNetworkLosesAreAskedForAgain) {
  const GigePart camera({"--own-packets", "--resend", "--lost", "20"});
  RealRigToml toml = this->toml();
  // A busy machine may take its time to hand packets on.
  camera.put_into(toml, "frame_retention_ms = 2000\n");
  const auto frames = scanned_frames(rig_folder(), toml.text(), kPoses);
  GigePart::expect_own_exposures(frames);
  EXPECT_THAT(log(), HasSubstr("packets were lost on their way, and came when they were asked for again"));
  EXPECT_THAT(reasons(), Not(Contains(HasSubstr("damaged"))));
}

}  // namespace
}  // namespace rig::test
