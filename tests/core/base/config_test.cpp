// Reading TOML: every mistake is found in one run, and each names file, line, column and key.
#include "core/base/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::base {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

ConfigTable table_of(const std::string& text) {
  auto parsed = ConfigTable::parse(text, "test.toml");
  EXPECT_TRUE(parsed.has_value()) << parsed.error().text();
  return *parsed;
}

std::string complaints(const ConfigTable& table) {
  const auto done = table.finish();
  return done ? std::string() : done.error().text();
}

TEST(Config, ReadsEveryKind) {
  const ConfigTable t = table_of(R"(
    number = 1.5
    whole = 7
    yes = true
    word = "text"
    list = [1, 2.5]
    words = ["a", "b"]
    rows = [[1, 2], [3, 4]]
    [sub]
    x = 1
    [[many]]
    y = 1
    [[many]]
    y = 2
  )");
  EXPECT_EQ(t.number("number", {0, 2}), 1.5);
  EXPECT_EQ(t.integer("whole", 0, 10), 7);
  EXPECT_TRUE(t.boolean_or("yes", false));
  EXPECT_EQ(t.text("word"), "text");
  EXPECT_THAT(t.numbers("list", 2, {0, 10}), ElementsAre(1, 2.5));
  EXPECT_THAT(t.texts("words"), ElementsAre("a", "b"));
  EXPECT_THAT(t.rows("rows", 2), ElementsAre(ElementsAre(1, 2), ElementsAre(3, 4)));
  EXPECT_EQ(t.table("sub").integer("x", 0, 9), 1);
  const auto many = t.tables("many");
  ASSERT_EQ(many.size(), 2U);
  EXPECT_EQ(many[0].integer("y", 0, 9), 1);
  EXPECT_EQ(many[1].integer("y", 0, 9), 2);
  EXPECT_THAT(t.keys(),
              ElementsAre("number", "whole", "yes", "word", "list", "words", "rows", "sub", "many"));
  EXPECT_EQ(complaints(t), "");
}

TEST(Config, AWholeNumberIsANumberToo) {
  const ConfigTable t = table_of("speed = 3");
  EXPECT_EQ(t.number("speed", {0, 10}), 3.0);
  EXPECT_EQ(complaints(t), "");
}

TEST(Config, FallbacksServeOnlyWhereTheKeyIsAbsent) {
  const ConfigTable t = table_of("a = 1\nb = \"x\"");
  EXPECT_EQ(t.number_or("a", 9, {0, 10}), 1);
  EXPECT_EQ(t.number_or("missing", 9, {0, 10}), 9);
  EXPECT_EQ(t.integer_or("none", 4, 0, 10), 4);
  EXPECT_EQ(t.text_or("b", "y"), "x");
  EXPECT_EQ(t.text_or("c", "y"), "y");
  EXPECT_FALSE(t.table_if("d").has_value());
  EXPECT_TRUE(t.tables("e").empty());
  EXPECT_EQ(complaints(t), "");
}

TEST(Config, SyntaxErrorNamesThePlace) {
  const auto parsed = ConfigTable::parse("a = 1\nb = = 2\n", "bad.toml");
  ASSERT_FALSE(parsed.has_value());
  EXPECT_EQ(parsed.error().code, ErrorCode::bad_input);
  EXPECT_THAT(parsed.error().where, HasSubstr("bad.toml:2:"));
}

TEST(Config, UnknownKeyNamesPlaceAndNearestKnownKey) {
  const ConfigTable t = table_of("[axis]\nspeeed_deg_s = 1.0\n");
  static_cast<void>(t.table("axis").number_or("speed_deg_s", 1, {0, 10}));
  EXPECT_EQ(complaints(t), "test.toml:2:1: axis.speeed_deg_s: unknown key (did you mean 'speed_deg_s'?)");
}

TEST(Config, UnknownKeyFarFromEverythingGetsNoAdvice) {
  const ConfigTable t = table_of("zebra = 1\nspeed = 1");
  static_cast<void>(t.number("speed", {0, 10}));
  EXPECT_THAT(complaints(t), HasSubstr("test.toml:1:1: zebra: unknown key"));
  EXPECT_THAT(complaints(t), Not(HasSubstr("did you mean")));
}

TEST(Config, UnknownTableInsideATableOfTables) {
  const ConfigTable t = table_of("[[m]]\nname = \"a\"\n[[m]]\nname = \"b\"\n[m.extra]\nx = 1\n");
  for (const ConfigTable& m : t.tables("m")) static_cast<void>(m.text("name"));
  EXPECT_THAT(complaints(t), HasSubstr("extra: unknown key"));
}

TEST(Config, MissingKeyNamesTheTableAndTheExpectation) {
  const ConfigTable t = table_of("[camera]\nwidth = 3\n");
  const ConfigTable camera = t.table("camera");
  static_cast<void>(camera.integer("width", 1, 10));
  EXPECT_EQ(camera.number("fx_px", {1, 5}), 1) << "a neutral value, so that reading can go on";
  EXPECT_THAT(complaints(t), HasSubstr("test.toml:1:1: camera.fx_px: is missing (a number from 1 to 5)"));
}

TEST(Config, RangesAreClosedAndRefuseWhatIsNoNumber) {
  const ConfigTable t = table_of("a = 1.0\nb = 1.0000001\nc = nan\nd = inf\ne = \"1\"\nf = 1.5");
  EXPECT_EQ(t.number("a", {0, 1}), 1.0);
  EXPECT_EQ(t.number("b", {0, 1}), 0.0);
  EXPECT_EQ(t.number("c", {0, 1}), 0.0);
  EXPECT_EQ(t.number("d", {0, 1}), 0.0);
  EXPECT_EQ(t.number("e", {0, 1}), 0.0);
  EXPECT_EQ(t.integer("f", 0, 9), 0);
  const std::string text = complaints(t);
  EXPECT_THAT(text, Not(HasSubstr("test.toml:1:")));
  EXPECT_THAT(text, HasSubstr("test.toml:2:5: b: is 1.0000001, outside 0 to 1"));
  EXPECT_THAT(text, HasSubstr("test.toml:3:5: c: must be a number"));
  EXPECT_THAT(text, HasSubstr("test.toml:4:5: d: must be a number"));
  EXPECT_THAT(text, HasSubstr("test.toml:5:5: e: must be a number"));
  EXPECT_THAT(text, HasSubstr("test.toml:6:5: f: must be a whole number"));
}

TEST(Config, ArraysOfWrongShape) {
  const ConfigTable t = table_of("a = [1, 2]\nb = [1, \"x\"]\nc = [[1, 2],\n [3]]\nd = 5\ne = [\"x\", 1]");
  static_cast<void>(t.numbers("a", 3, {0, 9}));
  static_cast<void>(t.numbers("b", 2, {0, 9}));
  static_cast<void>(t.rows("c", 2));
  static_cast<void>(t.rows("d", 2));
  static_cast<void>(t.texts("e"));
  const std::string text = complaints(t);
  EXPECT_THAT(text, HasSubstr("a: has the wrong shape (an array of 3 numbers)"));
  EXPECT_THAT(text, HasSubstr("b: item 2 must be a number"));
  EXPECT_THAT(text, HasSubstr("c: row 2 (line 4) must be 2 numbers"));
  EXPECT_THAT(text, HasSubstr("d: must be an array of rows"));
  EXPECT_THAT(text, HasSubstr("e: item 2 must be a text"));
}

TEST(Config, AChoiceListsWhatIsAllowed) {
  const ConfigTable t = table_of("mode = \"fsat\"");
  EXPECT_EQ(t.choice("mode", {"fast", "slow"}), "fast");
  EXPECT_EQ(complaints(t), "test.toml:1:8: mode: is 'fsat' (one of 'fast', 'slow')");
}

TEST(Config, ATableWhereAValueStands) {
  const ConfigTable t = table_of("axis = 3\nmodule = 4");
  static_cast<void>(t.table("axis").number("x", {0, 1}));
  EXPECT_TRUE(t.tables("module").empty());
  EXPECT_THAT(complaints(t), HasSubstr("test.toml:1:8: axis: must be a table"));
  EXPECT_THAT(complaints(t), HasSubstr("test.toml:2:10: module: must be an array of tables ([[module]])"));
}

TEST(Config, EveryMistakeInOneRunInALineEach) {
  const ConfigTable t = table_of("a = 5\nb = \"x\"\nunknown = 1\n");
  static_cast<void>(t.number("a", {0, 1}));
  static_cast<void>(t.number("b", {0, 1}));
  static_cast<void>(t.text("c"));
  t.error("a", "does not suit b", "change one");
  const std::string text = complaints(t);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4) << text;
  EXPECT_THAT(text, HasSubstr("test.toml:1:5: a: does not suit b (change one)"));
  EXPECT_THAT(text, HasSubstr("unknown: unknown key"));
  EXPECT_EQ(complaints(t), text) << "asking twice gives the same answer";
}

TEST(Config, PartsLeftToOthersAreNotSearched) {
  const ConfigTable t = table_of("[settings]\nanything = 1\n[settings.deeper]\nmore = 2\n");
  t.table("settings").leave_to_others();
  EXPECT_EQ(complaints(t), "");
}

TEST(Config, AFileThatIsNotThere) {
  const auto parsed = ConfigTable::parse_file("/nonexistent/rig.toml");
  ASSERT_FALSE(parsed.has_value());
  EXPECT_EQ(parsed.error().code, ErrorCode::not_found);
  EXPECT_THAT(parsed.error().text(), HasSubstr("/nonexistent/rig.toml"));
}

TEST(Result, AnErrorReadsWhereWhatHint) {
  EXPECT_EQ((Error{ErrorCode::io, "what", "where", "hint"}).text(), "where: what (hint)");
  EXPECT_EQ((Error{ErrorCode::io, "what", "", ""}).text(), "what");
}

TEST(Config, TextThatTheParserDidNotExpectIsAnErrorToo) {
  for (const char* text : {"[;x]\n", "[[.a]]\n", "[ ]\n", "a = [;\n", "[\x01]\n", ";"}) {
    const auto table = ConfigTable::parse(text, "x.toml");
    ASSERT_FALSE(table.has_value()) << text;
    EXPECT_NE(table.error().text().find("x.toml:1:"), std::string::npos) << table.error().text();
  }
}

}  // namespace
}  // namespace rig::base
