// One value changes, everything else in the text stays as its owner wrote it.
#include "core/base/config_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <sstream>

#include "core/base/files.h"

namespace rig::base {
namespace {

using testing::HasSubstr;

constexpr const char* kText = R"(# the rig, ü and all
name = "night"  # of the rig

[[module]]
name = "first"
[module.settings.axis.pan]
counts_per_deg = 100   # of the gear

[[module]]
name = "second"
[module.settings]
inner = { a = 1, deep = { b = 2.5 } }  # inline
none = {}
tight = {a=1}
[module.settings.axis.pan]
counts_per_deg = 200

[axis.pan]
  min_deg   =  -90.0# no space
  list = [1,
    2,  # two
  ]  # end of the list
  # the last word on pan

[axis.tilt]
[empty]
# nothing here
[text]
"é" = 'ünder'  # ö
)";

std::string edited(const std::vector<std::string>& path, const TomlScalar& value,
                   const std::string& text = kText) {
  auto out = edit_toml_value(text, path, value);
  EXPECT_TRUE(out.has_value()) << out.error().text();
  return out ? *out : std::string();
}

// kText with `from`, which is in it once, replaced.
std::string with(const std::string& from, const std::string& to) {
  std::string text = kText;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string refused(const std::vector<std::string>& path, const TomlScalar& value = true,
                    const std::string& text = kText) {
  const auto out = edit_toml_value(text, path, value);
  EXPECT_FALSE(out.has_value()) << *out;
  return out ? std::string() : out.error().text();
}

TEST(ConfigEdit, ReplacesTheValueAlone) {
  EXPECT_EQ(edited({"axis", "pan", "min_deg"}, -85.5), with("-90.0#", "-85.5#"));
  EXPECT_EQ(edited({"name"}, std::string("a \"quiet\" one")), with("\"night\"", R"("a \"quiet\" one")"));
  EXPECT_EQ(edited({"text", "é"}, true), with("'ünder'", "true"));
}

TEST(ConfigEdit, WritesEachKindSoThatItReadsBackAsThat) {
  EXPECT_EQ(edited({"a"}, 90.0, "a = 1\n"), "a = 90.0\n");
  EXPECT_EQ(edited({"a"}, 1e-7, "a = 1\n"), "a = 1e-07\n");
  EXPECT_EQ(edited({"a"}, 0.1, "a = 1\n"), "a = 0.1\n");
  EXPECT_EQ(edited({"a"}, std::int64_t{-7}, "a = 1\n"), "a = -7\n");
  EXPECT_EQ(edited({"a"}, false, "a = 1\n"), "a = false\n");
  EXPECT_EQ(edited({"a"}, 2.0, "a = 1"), "a = 2.0");
}

TEST(ConfigEdit, FindsATableOfAnArrayByItsName) {
  EXPECT_EQ(edited({"module", "name=first", "settings", "axis", "pan", "counts_per_deg"}, 101.25),
            with("counts_per_deg = 100 ", "counts_per_deg = 101.25 "));
  EXPECT_EQ(edited({"module", "name=second", "settings", "axis", "pan", "counts_per_deg"}, std::int64_t{1}),
            with("counts_per_deg = 200", "counts_per_deg = 1"));
}

TEST(ConfigEdit, ReachesIntoInlineTables) {
  const std::vector<std::string> settings{"module", "name=second", "settings"};
  const auto below = [&](std::vector<std::string> more) {
    more.insert(more.begin(), settings.begin(), settings.end());
    return more;
  };
  EXPECT_EQ(edited(below({"inner", "deep", "b"}), 3.5), with("b = 2.5", "b = 3.5"));
  EXPECT_EQ(edited(below({"inner", "c"}), true), with("2.5 } }", "2.5 }, c = true }"));
  EXPECT_EQ(edited(below({"none", "c"}), true), with("none = {}", "none = { c = true }"));
  EXPECT_EQ(edited(below({"tight", "c"}), true), with("{a=1}", "{a=1, c = true}"));
}

TEST(ConfigEdit, AddsAMissingKeyAtTheEndOfItsTable) {
  EXPECT_EQ(edited({"axis", "pan", "reversed"}, true),
            with("  ]  # end of the list\n", "  ]  # end of the list\n  reversed = true\n"));
  EXPECT_EQ(edited({"axis", "tilt", "a b"}, 1.0), with("[axis.tilt]\n", "[axis.tilt]\n\"a b\" = 1.0\n"));
  EXPECT_EQ(edited({"empty", "x"}, true), with("[empty]\n", "[empty]\nx = true\n"));
  EXPECT_EQ(edited({"text", "x"}, true), std::string(kText) + "x = true\n");
  EXPECT_EQ(edited({"x"}, true), with("# of the rig\n", "# of the rig\nx = true\n"));
  EXPECT_EQ(edited({"module", "name=first", "x"}, true),
            with("name = \"first\"\n", "name = \"first\"\nx = true\n"));
}

TEST(ConfigEdit, AddsWhereThereIsNoLineToStandBelow) {
  EXPECT_EQ(edited({"x"}, true, ""), "x = true\n");
  EXPECT_EQ(edited({"x"}, true, "# a word\n[t]\ny = 1\n"), "x = true\n# a word\n[t]\ny = 1\n");
  EXPECT_EQ(edited({"x"}, true, "[t]\ny = 1\n"), "x = true\n[t]\ny = 1\n");
  EXPECT_EQ(edited({"t", "x"}, true, "[t]\ny = 1"), "[t]\ny = 1\nx = true\n");
  EXPECT_EQ(edited({"t", "x"}, true, "[t]"), "[t]\nx = true\n");
}

TEST(ConfigEdit, KeepsTheLineEndsOfTheText) {
  EXPECT_EQ(edited({"t", "x"}, true, "[t]\r\ny = 1 # c\r\n[u]\r\n"),
            "[t]\r\ny = 1 # c\r\nx = true\r\n[u]\r\n");
  EXPECT_EQ(edited({"t", "y"}, true, "[t]\r\ny = 1\r\n"), "[t]\r\ny = true\r\n");
}

TEST(ConfigEdit, SaysWhatIsWrongWithAPath) {
  EXPECT_EQ(refused({}), "no key was named");
  EXPECT_EQ(refused({"axis", "roll", "min_deg"}), "axis.roll: there is no such table");
  EXPECT_EQ(refused({"name", "x"}), "name: is no table");
  EXPECT_EQ(refused({"module", "x"}), "module: is an array of tables (say which one, as name=TEXT)");
  EXPECT_EQ(refused({"module", "name=third", "x"}), "module: there is none with name=third");
  EXPECT_EQ(refused({"module", "first", "x"}), "module: there is none with first");
  EXPECT_EQ(refused({"axis", "pan"}), "axis.pan: is not a single value");
  EXPECT_EQ(refused({"axis", "pan", "list"}), "axis.pan.list: is not a single value");
  EXPECT_THAT(refused({"a"}, true, "a = \n"), HasSubstr("line 1"));
  EXPECT_THAT(refused({"name"}, std::numeric_limits<double>::infinity()), HasSubstr("no number"));
}

TEST(ConfigEdit, LeavesToAPersonWhatHasNoPlaceInTheText) {
  // Only [axis.pan] stands in the text, not [axis].
  EXPECT_EQ(refused({"axis", "x"}), "axis.x: cannot be set in the text as it is (write it by hand)");
  EXPECT_THAT(refused({"t", "d", "x"}, true, "[t]\nd.e = 1\n"), HasSubstr("by hand"));
}

TEST(ConfigEdit, ChangesOneLineOfTheShippedRig) {
  const auto shipped = read_file(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  ASSERT_TRUE(shipped.has_value());
  for (const char* axis : {"roll", "tilt", "pan", "arm"}) {
    for (const std::vector<std::string>& path :
         {std::vector<std::string>{"axis", axis, "min_deg"},
          {"axis", axis, "max_deg"},
          {"module", "name=virtual", "settings", "axis", axis, "low_deg"}}) {
      std::istringstream before(*shipped);
      std::istringstream after(edited(path, -12.5, *shipped));
      int changed = 0;
      for (std::string a, b; std::getline(before, a) && std::getline(after, b);) {
        if (a == b) continue;
        ++changed;
        EXPECT_EQ(b, path.back() + " = -12.5");
      }
      EXPECT_EQ(changed, 1);
    }
  }
}

}  // namespace
}  // namespace rig::base
