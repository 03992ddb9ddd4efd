// [suspend], [notify], [park] and [light] life_hours of rig.toml.
#include "core/machine/unattended_config.h"

#include "core/base/units.h"
#include "tests/core/machine/rig_file.h"

namespace rig::machine {
namespace {

std::string with(const std::string& tables) {
  return shipped_rig_text() + "\n" + tables;
}

TEST(UnattendedConfig, EverythingMayBeLeftOut) {
  const UnattendedConfig config = rig_with({}).unattended;
  EXPECT_TRUE(config.notify.command.empty());
  EXPECT_FALSE(config.park_rad.has_value());
  EXPECT_FALSE(config.suspend.max_temperature_c.has_value());
  EXPECT_FALSE(config.suspend.fail_at_limit);
  EXPECT_EQ(config.suspend.disk_margin_bytes, 500e6);
}

TEST(UnattendedConfig, ReadsEveryKey) {
  const auto rig = parse_rig_config(
      with("[suspend]\nlight_band = 0.1\ndisk_margin_mb = 20\n"
           "max_temperature_c = 60\nlimit_s = 90\nperson_limit_s = 900\nat_limit = \"fail\"\n"
           "[notify]\ncommand = [\"/bin/mail\", \"lab\"]\ntimeout_s = 5\n"
           "[park]\nangles_deg = [0, 10, 0, 90]\n"),
      "rig.toml");
  ASSERT_TRUE(rig.has_value()) << rig.error().text();
  const UnattendedConfig& config = rig->unattended;
  EXPECT_EQ(config.suspend.light_band, 0.1);
  EXPECT_EQ(config.suspend.disk_margin_bytes, 20e6);
  EXPECT_EQ(config.suspend.max_temperature_c, 60.0);
  EXPECT_EQ(config.suspend.limit_s, 90);
  EXPECT_EQ(config.suspend.person_limit_s, 900);
  EXPECT_TRUE(config.suspend.fail_at_limit);
  EXPECT_EQ(config.notify.command, (std::vector<std::string>{"/bin/mail", "lab"}));
  EXPECT_EQ(config.notify.timeout_s, 5);
  ASSERT_TRUE(config.park_rad.has_value());
  EXPECT_NEAR((*config.park_rad)[3], base::radians(90), 1e-12);
}

TEST(UnattendedConfig, SaysWhatIsWrong) {
  for (const auto& [text, message] :
       {std::pair("[park]\nangles_deg = [0, 0, 0]\n", "angles_deg"),
        std::pair("[park]\nangles_deg = [0, 300, 0, 90]\n", "the rig may not stand parked"),
        std::pair("[notify]\ncommand = [\"mail\"]\n", "absolute path"),
        std::pair("[suspend]\nat_limit = \"forget\"\n", "at_limit"),
        std::pair("[suspend]\nlimit_s = 0\n", "limit_s"),
        std::pair("[suspend]\nperson_limit_s = -1\n", "person_limit_s"),
        std::pair("[suspend]\nlimits_s = 9\n", "limits_s")}) {
    const auto rig = parse_rig_config(with(text), "rig.toml");
    ASSERT_FALSE(rig.has_value()) << text;
    EXPECT_NE(rig.error().text().find(message), std::string::npos) << rig.error().text();
  }
}

}  // namespace
}  // namespace rig::machine
