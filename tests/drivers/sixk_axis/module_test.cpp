// The module through its door, as rigd opens it.
#include "tests/drivers/loaded_module.h"

namespace rig::drivers::sixk {
namespace {

TEST(SixkModule, ChecksItsSettingsAndLosesAnAbsentLine) {
  test::expect_serial_axis_module("sixk_axis", R"([axis.pan]
max_velocity_deg_s = 10
max_acceleration_deg_s2 = 10
number = 1
counts_per_deg = 100
home_velocity_deg_s = 5
)");
}

}  // namespace
}  // namespace rig::drivers::sixk
