// The shipped rig.toml, as it is and with lines changed.
#pragma once

#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// Without the settings of the driver module, which hold keys of the same names and are not ours to read.
inline std::string shipped_rig_text() {
  auto text = base::read_file(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  EXPECT_TRUE(text.has_value());
  const auto begin = text->find("[module.settings");
  const auto end = text->find("[axis.roll]");
  EXPECT_LT(begin, end);
  return text->replace(begin, end - begin, "[module.settings]\nseed = 1\n\n");
}

using Changes = std::vector<std::pair<std::string, std::string>>;

/// The shipped text with the first occurrence of each `first` replaced by its `second`.
inline std::string changed_rig_text(const Changes& changes) {
  std::string text = shipped_rig_text();
  for (const auto& [from, to] : changes) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
  }
  return text;
}

inline RigConfig rig_with(const Changes& changes) {
  auto rig = parse_rig_config(changed_rig_text(changes), "rig.toml");
  EXPECT_TRUE(rig.has_value()) << rig.error().text();
  return std::move(rig).value();
}

/// A rig so cramped that many moves are forbidden: the light circles just outside the carrier, and a fat
/// camera stands close to the light's way.
inline RigConfig cramped_rig() {
  return rig_with(
      {{"arm_radius_mm = 1000.0", "arm_radius_mm = 300.0"},
       {"position_mm = [0.0, 0.0, 1225.4]", "position_mm = [60.0, 90.0, 450.0]"},
       {"light_radius_mm = 60.0", "light_radius_mm = 70.0"},
       {"first = \"light\"\nsecond = \"carrier\"\nclearance_mm = 50.0",
        "first = \"carrier\"\nsecond = \"light\"\nclearance_mm = 110.0\n\n[[keep_out]]\n"
        "name = \"carrier and camera\"\nfirst = \"carrier\"\nsecond = \"camera\"\nclearance_mm = 240.0"}});
}

}  // namespace rig::machine
