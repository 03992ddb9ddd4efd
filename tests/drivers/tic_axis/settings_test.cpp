// The module's settings, and what a Tic is compared with.
#include "drivers/tic_axis/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "drivers/tic_axis/products.h"
#include "drivers/tic_axis/setup_check.h"

namespace rig::drivers::tic {
namespace {

using base::ConfigTable;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const char* const kArm = R"([axis.arm]
serial = "00123456"
counts_per_deg = 44.5
max_velocity_deg_s = 20.0
max_acceleration_deg_s2 = 40.0
step_mode = 8
current_limit_ma = 1500
homing = "reverse"
)";

struct Parsed {
  ModuleSettings module;
  std::string errors;
};

Parsed parse(const std::string& text) {
  const auto table = ConfigTable::parse(text, "rig.toml");
  if (!table) return {{}, table.error().text()};
  Parsed parsed{read_module_settings(*table), {}};
  if (const auto fine = table->finish(); !fine) parsed.errors = fine.error().text();
  return parsed;
}

TEST(TicModuleSettings, WhatIsGivenAndWhatIsUsual) {
  const Parsed p = parse(kArm);
  EXPECT_EQ(p.errors, "");
  ASSERT_THAT(p.module.tics, SizeIs(1));
  const TicSettings& tic = p.module.tics[0];
  EXPECT_EQ(tic.axis.name, "arm");
  EXPECT_EQ(tic.place.serial, "00123456");
  EXPECT_EQ(tic.place.transport, "usb");
  EXPECT_EQ(tic.step_mode, 8);
  EXPECT_EQ(tic.current_limit_ma, 1500);
  EXPECT_EQ(tic.command_timeout_ms, std::nullopt);
  EXPECT_EQ(tic.homing, Homing::reverse);
  EXPECT_EQ(tic.stop, Stop::halt);
  EXPECT_EQ(tic.min_vin_v, 0);
  EXPECT_EQ(p.module.silence.count(), 2000);
  EXPECT_FALSE(p.module.write_settings);
}

TEST(TicModuleSettings, EverythingElse) {
  std::string text = kArm;
  text = "silence_ms = 5000\nwrite_settings = true\nanswer_ms = 100\nattempts = 2\n" + text;
  text.replace(text.find("serial = \"00123456\""), 19, "usb_path = \"1-1.4\"");
  text.replace(text.find("homing = \"reverse\""), 18, "homing = \"set_here\"\nhome_switch = \"forward\"");
  text +=
      "command_timeout_ms = 500\nstop = \"decelerate\"\nmin_vin_v = 10.5\ntransport = \"unix:/run/tic\"\n";
  const Parsed p = parse(text);
  EXPECT_EQ(p.errors, "");
  const TicSettings& tic = p.module.tics.at(0);
  EXPECT_EQ(tic.place.usb_path, "1-1.4");
  EXPECT_EQ(tic.place.transport, "unix:/run/tic");
  EXPECT_EQ(tic.homing, Homing::set_here);
  EXPECT_TRUE(tic.switch_is_forward);
  EXPECT_EQ(tic.command_timeout_ms, 500);
  EXPECT_EQ(tic.stop, Stop::decelerate);
  EXPECT_EQ(tic.min_vin_v, 10.5);
  EXPECT_EQ(p.module.silence.count(), 5000);
  EXPECT_TRUE(p.module.write_settings);
  EXPECT_EQ(p.module.retry.attempts, 2);
}

// Each line replaced by a wrong one is an error that names its key.
TEST(TicModuleSettings, MistakesAreNamed) {
  struct Mistake {
    std::string line, by, says;
  };
  for (const Mistake& m : {
           Mistake{"serial = \"00123456\"", "", "serial"},
           Mistake{"serial = \"00123456\"", "serial = \"1\"\nusb_path = \"1-1\"", "serial"},
           Mistake{"step_mode = 8", "step_mode = 12", "power of two"},
           Mistake{"step_mode = 8", "step_mode = 512", "step_mode"},
           Mistake{"step_mode = 8", "", "step_mode"},
           Mistake{"current_limit_ma = 1500", "", "current_limit_ma"},
           Mistake{"current_limit_ma = 1500", "current_limit_ma = 10000", "current_limit_ma"},
           Mistake{"homing = \"reverse\"", "homing = \"up\"", "homing"},
           Mistake{"homing = \"reverse\"", "", "homing"},
           Mistake{"homing = \"reverse\"", "homing = \"set_here\"", "home_switch"},
           Mistake{"homing = \"reverse\"", "homing = \"none\"\nstop = \"gently\"", "stop"},
           Mistake{"homing = \"reverse\"", "homing = \"none\"\ncommand_timeout_ms = 0", "command_timeout_ms"},
           Mistake{"homing = \"reverse\"", "homing = \"none\"\ntransport = \"i2c\"", "transport"},
           Mistake{"homing = \"reverse\"", "homing = \"none\"\nspeed = 1", "speed"},
           // 44.5 microsteps a degree: 50000 microsteps/s are 1123 degrees/s.
           Mistake{"max_velocity_deg_s = 20.0", "max_velocity_deg_s = 1124.0", "max_velocity_deg_s"},
           Mistake{"max_acceleration_deg_s2 = 40.0", "max_acceleration_deg_s2 = 0.02",
                   "max_acceleration_deg_s2"},
       }) {
    std::string text = kArm;
    text.replace(text.find(m.line), m.line.size(), m.by);
    EXPECT_THAT(parse(text).errors, HasSubstr(m.says)) << m.by;
  }
  EXPECT_THAT(parse("silence_ms = 100\n" + std::string(kArm)).errors, HasSubstr("silence_ms"));
  EXPECT_THAT(parse("").errors, HasSubstr("no axis"));
}

TEST(TicModuleSettings, OneTicIsOneAxis) {
  std::string second = kArm;
  second.replace(second.find("axis.arm"), 8, "axis.pan");
  EXPECT_THAT(parse(kArm + second).errors, HasSubstr("are one Tic"));
  second.replace(second.find("00123456"), 8, "00123457");
  const Parsed p = parse(kArm + second);
  EXPECT_EQ(p.errors, "");
  EXPECT_THAT(p.module.tics, SizeIs(2));
}

TEST(TicRates, AreRoundedDown) {
  const CountScale scale{1600 / (2 * base::kPi)};  // 1600 microsteps a turn
  const double turn = 2 * base::kPi;
  EXPECT_EQ(*tic_speed(scale, turn), 16'000'000U) << "1600 microsteps/s";
  EXPECT_EQ(*tic_accel(scale, turn), 160'000U);
  // 0.99999 of a unit more than one is one.
  EXPECT_EQ(*tic_speed(scale, turn * 1.99999 / 16'000'000), 1U);
  EXPECT_EQ(*tic_speed(scale, turn * 0.5 / 16'000'000), 1U) << "never 0: that would be no speed at all";
  EXPECT_EQ(*tic_speed(scale, turn * 31.25), 500'000'000U);
  EXPECT_FALSE(tic_speed(scale, turn * 31.26));
  EXPECT_EQ(*tic_accel(scale, turn * 100.0 / 160'000), 100U);
  EXPECT_FALSE(tic_accel(scale, turn * 99.0 / 160'000)) << "a Tic would accelerate faster than was allowed";
  EXPECT_FALSE(tic_accel(scale, turn * 1e9));
}

class TicSetup : public testing::Test {
 protected:
  TicSetup() {
    wanted.step_mode = 8;
    wanted.current_limit_ma = 1500;
    wanted.homing = Homing::reverse;
    is.command_timeout_ms = 1000;
    is.step_mode = now.step_mode = 3;
    is.current_limit = now.current_limit = 46;
    is.reverse_limit_pins = 4;
    is.homing_speed_towards = is.homing_speed_away = 1000;
    now.operation = Operation::normal;
  }
  [[nodiscard]] std::vector<Mismatch> compare() const { return compare_setup(wanted, identity, is, now); }
  [[nodiscard]] std::string what() const {
    const auto found = compare();
    return found.size() == 1 ? found[0].what : fmt::format("{} mismatches", found.size());
  }

  TicSettings wanted;
  Identity identity{0x00B3, 0x0106, "00123456", "Tic"};
  Settings is;
  Variables now;
};

TEST_F(TicSetup, AgreesWhereItDoes) {
  EXPECT_THAT(compare(), IsEmpty());
  wanted.command_timeout_ms = 1000;
  EXPECT_THAT(compare(), IsEmpty());
  EXPECT_EQ(mismatch_text({}, "1"), "");
}

TEST_F(TicSetup, StepModeAndCurrentAreComparedAndCanBeWritten) {
  is.step_mode = now.step_mode = 0;
  is.current_limit = now.current_limit = 6;
  wanted.command_timeout_ms = 500;
  const auto found = compare();
  ASSERT_THAT(found, SizeIs(3));
  EXPECT_EQ(found[0].what, "step_mode is 1 in the Tic, 8 in rig.toml");
  EXPECT_EQ(found[0].bytes, (std::vector<std::pair<std::uint16_t, std::uint8_t>>{{0x41, 3}}));
  EXPECT_EQ(found[1].what, "current_limit is 192 mA in the Tic, 1472 mA in rig.toml");
  EXPECT_EQ(found[1].bytes, (std::vector<std::pair<std::uint16_t, std::uint8_t>>{{0x40, 46}}));
  EXPECT_EQ(found[2].bytes, (std::vector<std::pair<std::uint16_t, std::uint8_t>>{{0x09, 0xF4}, {0x0A, 1}}));
  const std::string text = mismatch_text(found, "00123456");
  EXPECT_THAT(text, HasSubstr("'ticcmd -d 00123456 --get-settings tic.txt'"));
  EXPECT_THAT(text, HasSubstr("'step_mode: 8', 'current_limit: 1472', 'command_timeout: 500'"));
}

TEST_F(TicSetup, WhatIsOverriddenForNowIsSeen) {
  now.step_mode = 0;
  EXPECT_THAT(what(), HasSubstr("step_mode is overridden"));
  now.step_mode = 3;
  now.current_limit = 6;
  EXPECT_THAT(what(), HasSubstr("current_limit is overridden"));
  now.operation = Operation::soft_error;
  EXPECT_THAT(compare(), IsEmpty()) << "the limit for the time of an error";
}

TEST_F(TicSetup, WhatWouldBeDangerousIsAMismatch) {
  const auto alone = [&](auto change, const char* says) {
    const Settings before = is;
    change(is);
    EXPECT_THAT(what(), HasSubstr(says));
    is = before;
  };
  alone([](Settings& s) { s.control_mode = 1; }, "control_mode");
  alone([](Settings& s) { s.command_timeout_ms = 0; }, "no command timeout");
  alone([](Settings& s) { s.disable_safe_start = true; }, "safe start");
  alone([](Settings& s) { s.soft_error_response = SoftErrorResponse::go_to_position; }, "go to a position");
  alone([](Settings& s) { s.auto_homing = true; }, "homes by itself");
  alone([](Settings& s) { s.reverse_limit_pins = 0; }, "reverse limit switch");
  alone([](Settings& s) { s.homing_speed_towards = 0; }, "no speed");
  alone([](Settings& s) { s.homing_speed_away = 0; }, "no speed");
  wanted.homing = Homing::forward;
  EXPECT_THAT(what(), HasSubstr("forward limit switch"));
  wanted.homing = Homing::none;
  EXPECT_THAT(compare(), IsEmpty());
}

TEST_F(TicSetup, WhatTheTicCannotDoIsAMismatch) {
  wanted.step_mode = 64;
  EXPECT_THAT(what(), HasSubstr("a Tic T825 has no step mode 64"));
  wanted.step_mode = 8;
  wanted.current_limit_ma = 4000;
  EXPECT_THAT(what(), HasSubstr("at most 3968 mA"));
  identity.firmware = 0x0105;
  EXPECT_THAT(what(), HasSubstr("1.05"));
  identity.product = 0x1234;
  EXPECT_THAT(what(), HasSubstr("1234"));
}

// Its settings hold the registers of its motor driver, too, which only the Tic's own tool knows to set.
TEST_F(TicSetup, NothingIsWrittenToA36v4) {
  identity.product = static_cast<std::uint16_t>(Product::v36);
  wanted.current_limit_ma = 1500;
  is.current_limit = now.current_limit = current_code(Product::v36, 1000);
  is.step_mode = now.step_mode = 0;
  for (const Mismatch& each : compare()) EXPECT_THAT(each.bytes, IsEmpty()) << each.what;
  EXPECT_THAT(compare(), SizeIs(2));
}

}  // namespace
}  // namespace rig::drivers::tic
