// The shipped virtual rig with a camera of a quarter of the resolution, and a job of a few poses.
#pragma once

#include <gtest/gtest.h>
#include <string>

#include "core/base/files.h"

namespace rig::test {

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// 400 x 300 pixels instead of 1600 x 1200; everything else as shipped.
inline std::string small_rig_toml() {
  const auto shipped = base::read_file(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  EXPECT_TRUE(shipped.has_value());
  std::string text = replaced(*shipped, "width = 1600", "width = 400");
  text = replaced(text, "height = 1200", "height = 300");
  text = replaced(text, "fx_px = 6000.0", "fx_px = 1500.0");
  text = replaced(text, "fy_px = 6000.0", "fy_px = 1500.0");
  text = replaced(text, "cx_px = 803.2", "cx_px = 200.8");
  return replaced(text, "cy_px = 596.4", "cy_px = 149.1");
}

}  // namespace rig::test
