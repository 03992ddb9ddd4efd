// The shipped virtual rig, a clock that a test sets, and cameras small enough for a test.
#pragma once

#include <gtest/gtest.h>
#include <mutex>

#include "core/base/clock.h"
#include "core/base/config.h"
#include "sim/world.h"

namespace rig::sim::testing {

/// Time is what the test says. Nothing waits in it.
class SetClock final : public base::Clock {
 public:
  [[nodiscard]] base::Time now() const override { return now_; }
  bool wait(base::WaitSlot&, std::optional<base::Time>, base::WaitFor) override { return true; }
  void notify(base::WaitSlot&) override {}
  void join() override {}
  void leave() override {}
  void not_before(base::Time time) override { now_ = std::max(now_, time); }
  void pass(double seconds) { now_ += base::seconds(seconds); }

 private:
  base::Time now_{base::seconds(1e6)};
};

/// For a machine whose file of faults is right.
inline void no_complaint(const std::string& complaint) {
  ADD_FAILURE() << complaint;
}

inline World shipped_world() {
  const auto file = base::ConfigTable::parse_file(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  EXPECT_TRUE(file.has_value());
  const auto modules = file->tables("module");
  EXPECT_EQ(modules.size(), 1U);
  World world = read_world(modules.at(0).table("settings"));
  EXPECT_TRUE(modules.at(0).table("settings").noted().has_value());
  return world;
}

/// Without distortion, with square pixels of `mm` millimetres at the sample plane.
inline World small_world(int width, int height, double mm) {
  World world = shipped_world();
  CameraWorld& c = world.camera;
  c.width = width;
  c.height = height;
  c.fx = c.fy = (c.distance_m - world.plane_offset_m) / (1e-3 * mm);
  c.cx = 0.5 * (width - 1);
  c.cy = 0.5 * (height - 1);
  c.k1 = c.k2 = c.p1 = c.p2 = c.k3 = 0;
  return world;
}

}  // namespace rig::sim::testing
