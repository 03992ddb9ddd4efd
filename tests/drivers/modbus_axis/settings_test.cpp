// [module.settings]: what is read, and every mistake at its key.
#include "drivers/modbus_axis/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "drivers/host/module_loader.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/modbus_axis/opened_module.h"

namespace rig::drivers::modbus {
namespace {

using testing::AllOf;
using testing::HasSubstr;

base::ConfigTable table_of(const std::string& text) {
  auto table = base::ConfigTable::parse(text, "rig.toml");
  EXPECT_TRUE(table.has_value()) << table.error().text();
  return *table;
}

std::string mistake(const std::string& text) {
  const base::ConfigTable table = table_of(text);
  check_settings(table);
  const auto fine = table.finish();
  EXPECT_FALSE(fine.has_value());
  return fine ? std::string() : fine.error().text();
}

const std::string kRtu = "port = \"/dev/nowhere\"\nprofile = \"leadshine_pr\"\n";

TEST(Settings, OfALineAreAsTheDrivesComeFromTheFactory) {
  const auto table = table_of(kRtu + axis_settings("pan", 3) +
                              axis_settings("tilt", 4, "[axis.tilt.drive]\ncounts_per_turn = 800\n"));
  const ModuleSettings module = read_settings(table);
  ASSERT_TRUE(table.finish().has_value()) << table.finish().error().text();
  EXPECT_EQ(module.wire.serial.baud, 38400);
  EXPECT_EQ(module.wire.serial.parity, 'N');
  EXPECT_EQ(module.wire.gap, std::chrono::microseconds(1750));
  ASSERT_EQ(module.drives.size(), 2U);
  EXPECT_EQ(module.drives[0].slave, 3);
  EXPECT_EQ(module.drives[0].profile, module.drives[1].profile);
  EXPECT_EQ(module.drives[0].options[0], 10000);
  EXPECT_EQ(module.drives[1].options[0], 800);
}

TEST(Settings, OfALineKeepTheLongestSilence) {
  const auto gap = [](const std::string& text) {
    const auto table = table_of(text);
    const ModuleSettings module = read_settings(table);
    EXPECT_TRUE(table.finish().has_value()) << table.finish().error().text();
    return module.wire.gap;
  };
  using std::chrono::microseconds;
  const std::string oriental = "port = \"/dev/nowhere\"\nprofile = \"oriental_az\"\n";
  EXPECT_EQ(gap(oriental + axis_settings("pan", 1)), microseconds(3000));
  EXPECT_EQ(gap(oriental + "gap_ms = 7\n" + axis_settings("pan", 1)), microseconds(7000));
  // 3.5 characters of 11 bits at 9600 baud.
  EXPECT_EQ(gap(kRtu + "baud = 9600\n" + axis_settings("pan", 1)), microseconds(4010));
  EXPECT_EQ(gap("host = \"10.0.0.5\"\nprofile = \"oriental_az\"\n" + axis_settings("pan", 1)),
            microseconds(0));
}

TEST(Settings, DrivesThatDifferFromTheFactoryNeedToBeTold) {
  const std::string mixed =
      kRtu + axis_settings("pan", 1) + axis_settings("tilt", 2, "profile = \"oriental_cvd\"\n");
  EXPECT_THAT(mistake(mixed), AllOf(HasSubstr("baud"), HasSubstr("parity"), HasSubstr("differ")));
  const auto table = table_of("baud = 115200\nparity = \"even\"\n" + mixed);
  (void)read_settings(table);
  EXPECT_TRUE(table.finish().has_value()) << table.finish().error().text();
}

TEST(Settings, AnAddressOfTheNetworkIsTaken) {
  for (const char* address : {"10.0.0.5", "::1", "fe80::1%eth0"}) {
    const auto table = table_of(
        fmt::format("host = \"{}\"\nprofile = \"oriental_az\"\n{}", address, axis_settings("pan", 1)));
    EXPECT_EQ(read_settings(table).wire.host, address);
    EXPECT_TRUE(table.finish().has_value()) << table.finish().error().text();
  }
}

TEST(Settings, MistakesAreToldAtTheirKey) {
  EXPECT_THAT(mistake(kRtu), HasSubstr("given no axis"));
  EXPECT_THAT(mistake("profile = \"leadshine_pr\"\n" + axis_settings("pan", 1)),
              HasSubstr("port: is missing"));
  for (const char* name : {"gateway.local", "localhost", "10.0.0", "10.0.0.5:502", ""}) {
    EXPECT_THAT(
        mistake(fmt::format("host = \"{}\"\nprofile = \"oriental_az\"\n{}", name, axis_settings("pan", 1))),
        AllOf(HasSubstr("host: '"), HasSubstr("is no IP address"), HasSubstr("fixed address")));
  }
  EXPECT_THAT(mistake("host = \"10.0.0.5\"\n" + kRtu + axis_settings("pan", 1)),
              HasSubstr("stands beside 'host'"));
  EXPECT_THAT(
      mistake("host = \"10.0.0.5\"\nbaud = 9600\nprofile = \"oriental_az\"\n" + axis_settings("pan", 1)),
      AllOf(HasSubstr("baud"), HasSubstr("unknown key")));
  EXPECT_THAT(mistake(kRtu + axis_settings("pan", 0)), AllOf(HasSubstr("axis.pan.slave"), HasSubstr("is 0")));
  EXPECT_THAT(mistake(kRtu + axis_settings("pan", 2) + axis_settings("tilt", 2)),
              AllOf(HasSubstr("axis.tilt.slave"), HasSubstr("axis 'pan' already")));
  EXPECT_THAT(mistake("port = \"/dev/x\"\n" + axis_settings("pan", 1)),
              HasSubstr("axis.pan.profile: is missing"));
  EXPECT_THAT(mistake(kRtu + axis_settings("pan", 1, "profile = \"leadshin\"\n")),
              AllOf(HasSubstr("axis.pan.profile"), HasSubstr("no drive 'leadshin'")));
  EXPECT_THAT(
      mistake(kRtu + axis_settings("pan", 1, "[axis.pan.drive]\ncounts_per_turns = 800\n")),
      AllOf(HasSubstr("axis.pan.drive.counts_per_turns"), HasSubstr("did you mean 'counts_per_turn'")));
  EXPECT_THAT(mistake(kRtu + axis_settings("pan", 1, "[axis.pan.drive]\ncounts_per_turn = 1\n")),
              AllOf(HasSubstr("axis.pan.drive.counts_per_turn"), HasSubstr("outside 200")));
  EXPECT_THAT(mistake(kRtu + axis_settings("pan", 1, "soft_low_deg = 5\nsoft_high_deg = -5\n")),
              HasSubstr("must be above soft_low_deg"));
  EXPECT_THAT(mistake(kRtu + axis_settings("pan", 1, "soft_low_deg = 5\n")),
              HasSubstr("soft_high_deg: is missing"));
  EXPECT_THAT(mistake("port = \"/dev/x\"\nprofile = \"oriental_az\"\n" +
                      axis_settings("pan", 1, "soft_low_deg = -5\nsoft_high_deg = 5\n")),
              HasSubstr("no soft limits"));
}

TEST(Settings, MistakesInADriveDescriptionAreToldWithBothPlaces) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "mine.toml", "format = 1\nname = 3\n");
  const std::string path = (folder / "mine.toml").string();
  EXPECT_THAT(mistake("port = \"/dev/x\"\nprofile = \"" + path + "\"\n" + axis_settings("pan", 1)),
              AllOf(HasSubstr("axis.pan"), HasSubstr(path + ":2:8: name")));
}

TEST(Settings, AModuleWhoseSettingsAreWrongDoesNotOpen) {
  const auto clock = base::make_system_clock();
  const auto opened = open_module(kRtu + axis_settings("pan", 0), *clock);
  ASSERT_FALSE(opened.has_value());
  EXPECT_EQ(opened.error().code, base::ErrorCode::bad_input);
}

TEST(Settings, TheModuleIsLoadedAndCheckedAsRigdDoesIt) {
  const auto entry = load_module("modbus_axis", module_search_path());
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  EXPECT_STREQ((*entry)->name, "modbus_axis");
  const auto good = table_of(kRtu + axis_settings("pan", 1)), bad = table_of(kRtu + axis_settings("pan", 0));
  (*entry)->check(good);
  (*entry)->check(bad);
  EXPECT_TRUE(good.finish().has_value()) << good.finish().error().text();
  EXPECT_FALSE(bad.finish().has_value());
}

TEST(Settings, AxesOfOneLineAreOneBus) {
  const auto clock = base::make_system_clock();
  const auto opened = open_module(kRtu + axis_settings("pan", 1) + axis_settings("tilt", 2), *clock);
  ASSERT_TRUE(opened.has_value()) << opened.error().text();
  ASSERT_EQ(opened->size(), 2U);
  EXPECT_EQ((*opened)[0].name, "pan");
  EXPECT_EQ((*opened)[0].bus, (*opened)[1].bus);
  EXPECT_NEAR(axis_of((*opened)[0]).capabilities().resolution_rad, base::radians(0.001), 1e-12);
}

}  // namespace
}  // namespace rig::drivers::modbus
