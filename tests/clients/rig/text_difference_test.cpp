// What is shown before rig.toml is changed.
#include "clients/rig/text_difference.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/seed.h"

namespace rig::client {
namespace {

std::string difference(const std::string& before, const std::string& after) {
  return unified_difference(before, after, "old", "new");
}

TEST(TextDifference, ShowsAChangeWithWhatIsAroundIt) {
  EXPECT_EQ(difference("a\nb\nc\nd\ne\nf\ng\nh\ni\n", "a\nb\nc\nd\nE\nf\ng\nh\ni\n"),
            "--- old\n+++ new\n@@ -2,7 +2,7 @@\n b\n c\n d\n-e\n+E\n f\n g\n h\n");
}

TEST(TextDifference, OfEqualTextsIsEmpty) {
  EXPECT_EQ(difference("", ""), "");
  EXPECT_EQ(difference("a\nb\n", "a\nb\n"), "");
}

TEST(TextDifference, SeparatesWhatIsFarApart) {
  const std::string far = "1\n2\n3\n4\n5\n6\n7\n";
  EXPECT_EQ(difference("a\n" + far + "b\n", "A\n" + far + "B\n"),
            "--- old\n+++ new\n@@ -1,4 +1,4 @@\n-a\n+A\n 1\n 2\n 3\n@@ -6,4 +6,4 @@\n 5\n 6\n 7\n-b\n+B\n");
  const std::string near = "1\n2\n3\n4\n5\n6\n";
  EXPECT_EQ(difference("a\n" + near + "b\n", "A\n" + near + "B\n"),
            "--- old\n+++ new\n@@ -1,8 +1,8 @@\n-a\n+A\n 1\n 2\n 3\n 4\n 5\n 6\n-b\n+B\n");
}

TEST(TextDifference, NamesEmptyRangesByTheLineBefore) {
  EXPECT_EQ(difference("", "a\n"), "--- old\n+++ new\n@@ -0,0 +1,1 @@\n+a\n");
  EXPECT_EQ(difference("a\n", ""), "--- old\n+++ new\n@@ -1,1 +0,0 @@\n-a\n");
  EXPECT_EQ(difference("a\nb", "a\nx\nb"), "--- old\n+++ new\n@@ -1,2 +1,3 @@\n a\n+x\n b\n");
}

// Applies a difference; both texts end with a line end.
std::string patched(const std::string& before, const std::string& difference) {
  std::istringstream old(before);
  std::istringstream lines(difference);
  std::string out;
  std::string line;
  std::string old_line;
  std::size_t at = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with("---") || line.starts_with("+++")) continue;
    if (line.starts_with("@@")) {
      std::size_t from = 0;
      std::size_t count = 0;
      EXPECT_EQ(std::sscanf(line.c_str(), "@@ -%zu,%zu", &from, &count), 2) << line;
      for (; at + (count == 0 ? 0 : 1) < from && std::getline(old, old_line); ++at) out += old_line + "\n";
    } else if (line[0] == '+') {
      out += line.substr(1) + "\n";
    } else {
      EXPECT_TRUE(std::getline(old, old_line));
      EXPECT_EQ(old_line, line.substr(1));
      ++at;
      if (line[0] == ' ') out += old_line + "\n";
    }
  }
  while (std::getline(old, old_line)) out += old_line + "\n";
  return out;
}

TEST(TextDifference, LeadsFromOneTextToTheOther) {
  base::Random random(test::seed(61));
  for (int i = 0; i < 300; ++i) {
    const auto text = [&random] {
      std::string out;
      for (std::uint64_t k = random.below(30); k > 0; --k)
        out += static_cast<char>('a' + random.below(5)) + std::string("\n");
      return out;
    };
    const std::string before = text();
    const std::string after = text();
    EXPECT_EQ(patched(before, difference(before, after)), after) << before << "->\n" << after;
  }
}

}  // namespace
}  // namespace rig::client
