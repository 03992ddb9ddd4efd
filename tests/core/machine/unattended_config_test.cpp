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

constexpr const char* kReference =
    "[reference]\npose_deg = [0, 10, 0, 75]\nexposure_ms = 20\ndark_exposure_ms = 500\nevery_poses = 9\n";

TEST(UnattendedConfig, AFlatIsTakenWhereTheReferenceIsUnlessItHasItsOwnPose) {
  const auto read = [](const std::string& keys) {
    const auto rig =
        parse_rig_config(with(kReference + std::string("[reference.flat]\n") + keys), "rig.toml");
    EXPECT_TRUE(rig.has_value()) << rig.error().text();
    return rig ? *rig->unattended.reference->flat : FlatConfig();
  };
  EXPECT_FALSE(parse_rig_config(with(kReference), "rig.toml")->unattended.reference->flat.has_value());
  FlatConfig flat = read("exposure_ms = 4\n");
  EXPECT_NEAR(flat.pose_rad[3], base::radians(75), 1e-12);
  EXPECT_DOUBLE_EQ(flat.exposure_s, 0.004);
  EXPECT_FALSE(flat.target.has_value());
  flat = read(
      "exposure_ms = 4\npose_deg = [0, 12, 0, 60]\ntarget_mm = [-5, 95, 24, 16]\nband = 0.1\n"
      "evenness = 0.05\n");
  EXPECT_NEAR(flat.pose_rad[1], base::radians(12), 1e-12);
  ASSERT_TRUE(flat.target.has_value());
  EXPECT_NEAR(flat.target->x_m, -0.005, 1e-12);
  EXPECT_NEAR(flat.target->y_m, 0.095, 1e-12);
  EXPECT_NEAR(flat.target->width_m, 0.024, 1e-12);
  EXPECT_NEAR(flat.target->height_m, 0.016, 1e-12);
  EXPECT_EQ(flat.band, 0.1);
  EXPECT_EQ(flat.evenness, 0.05);
}

TEST(UnattendedConfig, SaysWhatIsWrongWithAFlat) {
  for (const auto& [keys, message] :
       {std::pair("band = 0.1\n", "exposure_ms"),
        std::pair("exposure_ms = 4\npose_deg = [0, 12, 60]\n", "pose_deg"),
        std::pair("exposure_ms = 4\npose_deg = [0, 85, 0, 60]\n", "may not stand where the flat is taken"),
        std::pair("exposure_ms = 4\ntarget_mm = [0, 0, 0, 10]\n", "has no size"),
        std::pair("exposure_ms = 4\ntarget_mm = [0, 0, 10]\n", "target_mm"),
        std::pair("exposure_ms = 4\ntarget_mm = [500, 0, 10, 10]\n", "not wholly inside the image"),
        std::pair("exposure_ms = 4\nband = 0\n", "band"),
        std::pair("exposure_ms = 4\nevenes = 0.1\n", "evenes")}) {
    const auto rig =
        parse_rig_config(with(kReference + std::string("[reference.flat]\n") + keys), "rig.toml");
    ASSERT_FALSE(rig.has_value()) << keys;
    EXPECT_NE(rig.error().text().find(message), std::string::npos) << rig.error().text();
  }
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
