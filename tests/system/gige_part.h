// A simulated camera on GigE Vision as a part of a rig, whose frames tell how they were taken.
#pragma once

#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <string>
#include <vector>

#include "sim/wire/gv_camera_process.h"
#include "sim/wire/gv_pattern.h"
#include "tests/system/program.h"
#include "tests/system/real_rig.h"

namespace rig::test {

class GigePart {
 public:
  /// `further`: arguments of rig-sim-gv-camera.
  explicit GigePart(const std::vector<std::string>& further = {}) : process_(started(further)) {}

  /// `more`: settings beside the usual ones.
  void put_into(RealRigToml& toml, const std::string& more = "") const {
    toml.module("eye", "aravis_camera",
                "address = \"127.0.0.1\"\npixel_format = \"Mono16\"\nwidth = 160\nheight = 120\n"
                "packet_size = 1400\nreadout_ms = 0\n" +
                    more);
    toml.part("camera", "eye", "camera")
        .set_in("camera", "bayer", "\"none\"")
        .set_in("camera", "bits", "16")
        .set_in("camera", "black_dn", "0.0")
        .set_in("camera", "saturation_dn", "65535.0");
  }

  /// Every pixel of every frame says that it was exposed as its file claims and as the job asked.
  static void expect_own_exposures(const std::map<std::string, scan::Frame>& frames) {
    std::map<int, int> seen;
    for (const auto& [name, frame] : frames) {
      const auto facts = sim::wire::read_pattern(frame.pixels, static_cast<std::size_t>(frame.width), 16);
      ASSERT_TRUE(facts.has_value()) << name << ": its pixels contradict each other";
      EXPECT_NEAR(facts->exposure_us, frame.facts.exposure_s * 1e6, 1) << name;
      ++seen[static_cast<int>(facts->exposure_us)];
    }
    const auto half = static_cast<int>(frames.size() / 2);
    EXPECT_EQ(seen, (std::map<int, int>{{8000, half}, {60000, half}})) << "the exposures of the job";
  }

 private:
  static sim::wire::GvCameraProcess started(const std::vector<std::string>& further) {
    std::vector<std::string> arguments{"--exposes"};
    arguments.insert(arguments.end(), further.begin(), further.end());
    auto process = sim::wire::GvCameraProcess::start(program_path("rig-sim-gv-camera"), arguments);
    EXPECT_TRUE(process.has_value()) << process.error().text();
    return std::move(*process);
  }

  sim::wire::GvCameraProcess process_;
};

}  // namespace rig::test
