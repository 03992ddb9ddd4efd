#include "drivers/common/rounding.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "drivers/common/printable.h"

namespace rig::drivers {
namespace {

TEST(Rounding, GoesTheWayThatItIsTold) {
  EXPECT_EQ(rounded(2.7, Rounding::down), 2);
  EXPECT_EQ(rounded(2.2, Rounding::up), 3);
  EXPECT_EQ(rounded(2.5, Rounding::nearest), 3);
  EXPECT_EQ(rounded(-2.2, Rounding::down), -3);
  EXPECT_EQ(rounded(-2.7, Rounding::up), -2);
}

TEST(Rounding, LeavesAWholeNumberButForItsLastBits) {
  // 0.3 / 0.1 is a bit less than 3, and 0.1 * 3 a bit more than 0.3.
  EXPECT_EQ(rounded(0.3 / 0.1, Rounding::down), 3);
  EXPECT_EQ(rounded(10 * (0.1 * 3), Rounding::up), 3);
  EXPECT_EQ(rounded(1e9 - 0.5, Rounding::down), 1e9);
  EXPECT_EQ(rounded(3 - 1e-6, Rounding::down), 2);
}

TEST(Rounding, OfWhatIsNoNumberIsNone) {
  EXPECT_TRUE(std::isnan(rounded(std::numeric_limits<double>::quiet_NaN(), Rounding::down)));
  EXPECT_TRUE(std::isinf(rounded(std::numeric_limits<double>::infinity(), Rounding::nearest)));
}

TEST(Printable, BytesOfTheWireCanBeRead) {
  EXPECT_EQ(printable("PP12 *"), "PP12 *");
  EXPECT_EQ(printable("a\r\x80"), "a\\x0d\\x80");
  EXPECT_EQ(printable(std::string(61, 'x')), std::string(60, 'x') + "...");
}

}  // namespace
}  // namespace rig::drivers
