// What a device says of its controls.
#include "drivers/v4l2_camera/controls.h"

#include <cstring>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

v4l2_queryctrl said(std::int32_t min, std::int32_t max, std::int32_t step) {
  v4l2_queryctrl about{};
  about.id = V4L2_CID_GAIN;
  about.type = V4L2_CTRL_TYPE_INTEGER;
  about.minimum = min;
  about.maximum = max;
  about.step = step;
  std::memcpy(about.name, "Gain, Analogue  (x 0.1)", 24);
  return about;
}

TEST(Controls, NamesAreThoseOfV4l2Ctl) {
  EXPECT_EQ(read_control(said(0, 1, 1)).name, "gain_analogue_x_0_1");
  v4l2_queryctrl full{};
  std::memset(full.name, 'A', sizeof full.name);
  EXPECT_EQ(read_control(full).name, std::string(sizeof full.name, 'a')) << "no end in its field";
}

TEST(Controls, ValuesAreBroughtOntoTheirStep) {
  const Control control = read_control(said(-10, 25, 10));
  EXPECT_EQ(control.nearest(-1000), -10);
  EXPECT_EQ(control.nearest(-5.1), -10);
  EXPECT_EQ(control.nearest(4), 0);
  EXPECT_EQ(control.nearest(19), 20);
  EXPECT_EQ(control.nearest(24.9), 20) << "the last step is below the maximum";
  EXPECT_EQ(control.nearest(std::numeric_limits<double>::quiet_NaN()), -10);
  const Control all = read_control(
      said(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max(), 1));
  EXPECT_EQ(all.nearest(1e300), std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(all.nearest(-3.4), -3);
}

TEST(Controls, ARangeThatContradictsItselfIsNotUsed) {
  EXPECT_FALSE(read_control(said(5, 4, 1)).usable);
  EXPECT_EQ(read_control(said(0, 4, 0)).step, 1) << "drivers leave it out";
  EXPECT_EQ(read_control(said(0, 4, -3)).step, 1);
}

TEST(Controls, OnlyWhatTakesAValueIsUsable) {
  EXPECT_TRUE(read_control(said(0, 4, 1)).usable);
  auto about = said(0, 4, 1);
  about.flags = V4L2_CTRL_FLAG_READ_ONLY;
  EXPECT_FALSE(read_control(about).usable);
  about.flags = V4L2_CTRL_FLAG_DISABLED;
  EXPECT_FALSE(read_control(about).usable);
  about.flags = V4L2_CTRL_FLAG_INACTIVE;
  EXPECT_TRUE(read_control(about).usable) << "until what is automatic is off";
  about.flags = 0;
  about.type = V4L2_CTRL_TYPE_BUTTON;
  EXPECT_FALSE(read_control(about).usable);
}

}  // namespace
}  // namespace rig::drivers::v4l2
