// Descriptions of drives: the ones that come with the program are whole, and every mistake in one is told
// with file, line and key.
#include "drivers/modbus_axis/profile.h"

#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"

namespace rig::drivers::modbus {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const std::string kWhole = R"(format = 1
name = "a drive"
[line]
baud = 9600
parity = "none"
word_order = "high_first"
[option.turn]
default = 1000
low = 1
[register.status]
address = 0x10
[register.position]
address = 0x20
type = "i32"
[register.alarm]
address = 0x30
[state]
position = "position"
alarm = "alarm"
fault = "status & 1"
enabled = "status & 2"
homed = "status & 4"
moving = "status & 8"
[alarm]
0x01 = "hot"
[value.place]
of = "position"
[value.rpm]
of = "velocity"
scale = 60
per = "turn"
[sequence]
move = ["0x40 = {place} {rpm}", "0x50 = 1"]
stop = ["0x50 = 2"]
home = ["0x50 = 3"]
[motion]
take_ms = 20
)";

// The whole description with one line (or lines) put in place of another.
std::string with(const std::string& line, const std::string& instead) {
  std::string text = kWhole;
  const auto at = text.find(line + "\n");
  EXPECT_NE(at, std::string::npos) << line;
  return text.replace(at, line.size(), instead);
}

std::string mistake(const std::string& text) {
  const auto profile = parse_profile(text, "a.toml");
  EXPECT_FALSE(profile.has_value());
  return profile ? std::string() : profile.error().text();
}

TEST(Profiles, ThatComeWithTheProgramAreWhole) {
  int found = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(RIG_SOURCE_DIR) / "share" / "drives")) {
    const auto text = base::read_file(entry.path());
    ASSERT_TRUE(text.has_value());
    const auto profile = parse_profile(*text, entry.path().string());
    EXPECT_TRUE(profile.has_value()) << profile.error().text();
    ++found;
  }
  EXPECT_EQ(found, 3);
}

TEST(Profiles, AreFoundByNameAndByPath) {
  const auto by_name = find_profile("leadshine_pr");
  ASSERT_TRUE(by_name.has_value()) << by_name.error().text();
  const auto by_path = find_profile(by_name->string());
  ASSERT_TRUE(by_path.has_value());
  EXPECT_EQ(*by_name, *by_path);
  EXPECT_THAT(find_profile("leadshine").error().text(), HasSubstr("drives"));
  EXPECT_THAT(find_profile("./leadshine_pr.toml").error().text(), HasSubstr("./leadshine_pr.toml"));
}

TEST(Profiles, AreReadAsTheyAreWritten) {
  const auto profile = parse_profile(kWhole, "a.toml");
  ASSERT_TRUE(profile.has_value()) << profile.error().text();
  EXPECT_EQ(profile->name, "a drive");
  EXPECT_EQ(profile->line.baud, 9600);
  EXPECT_EQ(profile->motion.take_ms, 20);
  EXPECT_EQ(profile->alarms.at(1), "hot");
  EXPECT_EQ(profile->move.size(), 2U);
  EXPECT_EQ(profile->values[1].round, Rounding::down);
  EXPECT_FALSE(profile->complete.has_value());
  EXPECT_TRUE(profile->replaces_moves);
  EXPECT_FALSE(profile->line.one_word_single);
}

struct Mistake {
  std::string line, instead;
  std::string place, what;  ///< both stand in the message
};

TEST(Profiles, EveryMistakeIsToldWithItsPlace) {
  const std::vector<Mistake> mistakes{
      {"format = 1", "format = 2", "a.toml:1:10: format", "is 2"},
      {"name = \"a drive\"", "", "a.toml", "name: is missing"},
      {"baud = 9600", "baud = 100", "a.toml:4:8: line.baud", "outside"},
      {"parity = \"none\"", "parity = \"mark\"", "a.toml:5:10: line.parity", "is 'mark'"},
      {"word_order = \"high_first\"", "word_order = \"big\"", "line.word_order", "'low_first'"},
      {"word_order = \"high_first\"", "word_order = \"high_first\"\ngap = 3", "a.toml:7:1: line.gap",
       "unknown key"},
      {"default = 1000", "default = 70000", "option.turn.default", "outside"},
      {"low = 1", "low = 2000", "option.turn.default", "outside"},
      {"[option.turn]", "[option.Turn]", "option.Turn", "cannot be a name"},
      {"address = 0x10", "address = 0x10000", "a.toml:11:11: register.status.address", "outside"},
      {"address = 0x20", "address = 0xFFFF", "register.position.address", "outside"},
      {"address = 0x20", "address_option = \"turns\"", "register.position.address_option",
       "no option 'turns'"},
      {"address = 0x20", "address_option = \"turn\"", "register.position.address_option",
       "may be no address"},
      {"type = \"i32\"", "type = \"f32\"", "a.toml:14:8: register.position.type", "'i32'"},
      {"position = \"position\"", "position = \"place\"", "state.position", "no register 'place'"},
      {"fault = \"status & 1\"", "", "state.fault", "is missing"},
      {"fault = \"status & 1\"", "fault = \"remembered\"", "state.fault", "only 'homed'"},
      {"enabled = \"status & 2\"", "enabled = \"stat & 2\"", "state.enabled", "no register 'stat'"},
      {"moving = \"status & 8\"", "", "state", "neither 'moving' nor 'complete'"},
      {"0x01 = \"hot\"", "hot = \"hot\"", "alarm.hot", "no alarm's number"},
      {"0x01 = \"hot\"", "0x01 = \"hot\"\n1 = \"cold\"", "alarm.1", "stands twice"},
      {"alarm = \"alarm\"", "", "a.toml", "names no register 'alarm'"},
      {"of = \"velocity\"", "of = \"speed\"", "value.rpm.of", "'velocity'"},
      {"scale = 60", "scale = 0", "value.rpm.scale", "outside"},
      {"per = \"turn\"", "per = \"turns\"", "value.rpm.per", "no option 'turns'"},
      {"low = 1", "low = 0", "value.rpm.per", "less than 1"},
      {"of = \"position\"", "of = \"position\"\ninverse = true", "value.place.inverse", "no inverse"},
      {"[value.place]", "[value.turn]\nof = \"velocity\"\n[value.place]", "value.turn", "is an option, too"},
      {"move = [\"0x40 = {place} {rpm}\", \"0x50 = 1\"]", "move = [\"0x40 = {rpm}\"]", "sequence.move",
       "no step writes a position"},
      {"move = [\"0x40 = {place} {rpm}\", \"0x50 = 1\"]", "move = [\"0x40 = {place}\", \"0x50 = {go}\"]",
       "sequence.move", "item 2"},
      {"stop = [\"0x50 = 2\"]", "", "sequence.stop", "is missing"},
      {"stop = [\"0x50 = 2\"]", "stop = []", "sequence.stop", "is empty"},
      {"home = [\"0x50 = 3\"]", "home = [\"0x50 = {place}\"]", "sequence.home", "not known in this sequence"},
      {"home = [\"0x50 = 3\"]", "expect = [\"0x50 = {rpm}\"]", "sequence.expect",
       "not known in this sequence"},
      {"home = [\"0x50 = 3\"]", "home = \"0x50 = 3\"", "sequence.home", "array of texts"},
      {"take_ms = 20", "take_ms = 0", "motion.take_ms", "outside"},
      {"take_ms = 20", "while_moving = \"wait\"", "motion.while_moving", "'refuse'"},
  };
  for (const Mistake& m : mistakes) {
    EXPECT_THAT(mistake(with(m.line, m.instead)), AllOf(HasSubstr(m.place), HasSubstr(m.what)))
        << "'" << m.line << "' as '" << m.instead << "'";
  }
}

TEST(Profiles, AllMistakesAreToldAtOnce) {
  std::string text = with("baud = 9600", "baud = 100");
  text.replace(text.find("stop = "), 4, "halt");
  EXPECT_THAT(mistake(text),
              AllOf(HasSubstr("line.baud"), HasSubstr("sequence.stop"), HasSubstr("sequence.halt")));
}

}  // namespace
}  // namespace rig::drivers::modbus
