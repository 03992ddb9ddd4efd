// The soak run in small: rigd is killed some twenty times over a few virtual nights with faults.
#include <gtest/gtest.h>

#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"
#include "tests/system/program.h"

namespace rig::test {

TEST(Soak, NothingIsLostByKillsAndFaults) {
  TemporaryFolder folder;
  const int status = run_program(
      "soak",
      {"--kills", "20", "--poses", "10", "--seed", std::to_string(seed(5)), "--folder", folder / "nights"},
      folder / "soak.log");
  EXPECT_EQ(status, 0) << bytes_in(folder / "soak.log");
  EXPECT_NE(bytes_in(folder / "soak.log").find(" 0 problems"), std::string::npos);
}

}  // namespace rig::test
