// The tiny virtual rig and a job of a few poses for it, for tests.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <string>

#include "tests/soak/tiny_rig.h"

namespace rig::test {

/// `faults` is the text below [module.settings.faults], or empty.
inline std::string tiny_rig_toml(const std::string& faults = "") {
  auto text = soak::tiny_rig(RIG_SOURCE_DIR "/share/virtual/rig.toml", faults);
  EXPECT_TRUE(text.has_value()) << text.error().text();
  return std::move(text).value();
}

/// Poses from side to side, so that every axis goes both ways and more than half a second each time.
inline std::string tiny_job(int poses = 6, int attempts = 3) {
  std::string text = fmt::format(
      "format = 1\nname = \"tiny\"\nsample = \"chart\"\n\n[exposure]\nstrategy = \"fixed\"\nexposures_us = "
      "[60000, 8000]\n\n[retry]\nattempts = {}\ndelay_s = 1\n\n[poses]\nangles_deg = [\n",
      attempts);
  for (int i = 0; i < poses; ++i) {
    const int side = i % 2 == 0 ? 1 : -1;
    text += fmt::format("  [{}, {}, {}, {}],\n", side * (30 + i), side * (12 + i), side * (40 - 2 * i),
                        95 + side * (20 - i));
  }
  return text + "]\n";
}

}  // namespace rig::test
