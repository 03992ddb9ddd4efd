// The module through its door, as rigd opens it.
#include "tests/drivers/loaded_module.h"

namespace rig::drivers::ptu {
namespace {

TEST(PtuModule, ChecksItsSettingsAndLosesAnAbsentLine) {
  test::expect_serial_axis_module("ptu_axis", R"([axis.pan]
max_velocity_deg_s = 10
max_acceleration_deg_s2 = 10
)");
}

}  // namespace
}  // namespace rig::drivers::ptu
