// A camera that an output line triggers gives the same scan as one that is commanded.
#include <gtest/gtest.h>

#include "tests/system/running_rig.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {
namespace {

std::map<std::string, std::string> scanned(const std::filesystem::path& folder, const std::string& rig_toml) {
  RunningRig rig(folder, rig_toml);
  rig.start();
  rig.submit(tiny_job(3));
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  return frames_of(rig.scan());
}

TEST(TriggerLine, BeginsEachExposure) {
  const TemporaryFolder folder;
  const auto commanded = scanned(folder / "commanded", tiny_rig_toml());
  const auto triggered = scanned(
      folder / "triggered",
      tiny_rig_toml() +
          "\n[lines.camera_trigger]\nmodule = \"virtual\"\ndevice = \"lines\"\nline = \"camera_trigger\"\n");
  EXPECT_EQ(commanded.size(), 6U);
  EXPECT_EQ(commanded, triggered);
}

TEST(TriggerLine, OneThatIsNotThereIsSaid) {
  const TemporaryFolder folder;
  put_bytes(folder / "rig.toml",
            tiny_rig_toml() +
                "\n[lines.camera_trigger]\nmodule = \"virtual\"\ndevice = \"lines\"\nline = \"flash\"\n");
  const int status = run_program(
      "rigd", {"--config", folder / "rig.toml", "--state", folder / "state", "--runtime", folder / "run"},
      folder / "log");
  EXPECT_NE(status, 0);
  EXPECT_NE(bytes_in(folder / "log").find("there is no output line 'flash'"), std::string::npos)
      << bytes_in(folder / "log");
}

}  // namespace
}  // namespace rig::test
