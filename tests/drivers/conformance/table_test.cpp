// The columns that tests write, and the table they make.
#include <gtest/gtest.h>
#include <thread>

#include "drivers/conformance/suite.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::conformance {
namespace {

class TableTest : public ::testing::Test {
 protected:
  void write(const std::string& module, std::size_t check, Outcome outcome) {
    (void)write_again(module, check, std::move(outcome), Earlier::forgotten);
  }
  Outcome write_again(const std::string& module, std::size_t check, Outcome outcome,
                      Earlier earlier = Earlier::counts) {
    const auto written =
        write_column(folder_.path(), module, {{checks().at(check), std::move(outcome)}}, earlier);
    EXPECT_TRUE(written.has_value()) << written.error().text();
    return written ? written->front() : Outcome{};
  }
  [[nodiscard]] std::string table() {
    auto text = table_of({folder_.path()});
    EXPECT_TRUE(text.has_value()) << text.error().text();
    return *text;
  }
  [[nodiscard]] std::string column(const std::string& module) const {
    return test::bytes_in(folder_ / (module + ".tsv"));
  }
  [[nodiscard]] static std::string name(std::size_t check) { return checks().at(check).name; }

  test::TemporaryFolder folder_;
};

TEST_F(TableTest, LinesComeTogetherInTheOrderOfTheChecks) {
  write("ptu", 3, {Verdict::not_proven, "no\tswitch\nthere"});
  write("ptu", 1, {Verdict::passed, ""});
  write("ptu", 2, {Verdict::failed, "it did not move"});
  EXPECT_EQ(column("ptu"), name(1) + "\tpassed\t1\t\n" + name(2) + "\tfailed\t1\tit did not move\n" +
                               name(3) + "\tnot proven\t1\tno switch there\n");
  write("ptu", 2, {Verdict::passed, ""});
  EXPECT_EQ(column("ptu"), name(1) + "\tpassed\t1\t\n" + name(2) + "\tpassed\t1\t\n" + name(3) +
                               "\tnot proven\t1\tno switch there\n");
}

TEST_F(TableTest, ARowPerCheckAColumnPerModuleAndWhy) {
  write("ptu", 0, {Verdict::passed, ""});
  write("dmx", 0, {Verdict::none, "no axis"});
  write("dmx", 1, {Verdict::failed, "it did not move"});
  write("ptu", 1, {Verdict::not_proven, "no switch"});
  const std::string text = table();
  EXPECT_EQ(text.find("| check | dmx | ptu |\n| --- | --- | --- |\n| " + name(0) + " | - | passed |\n| " +
                      name(1) + " | **failed** | not proven |\n| " + name(2) + " | not run | not run |\n"),
            0U)
      << text;
  EXPECT_NE(text.find("\nFailed:\n\n- dmx, " + name(1) + ": it did not move\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\nNot proven:\n\n- ptu, " + name(1) + ": no switch\n"), std::string::npos) << text;
}

TEST_F(TableTest, AFurtherTryIsTold) {
  write("ptu", 0, {Verdict::failed, "it came too late"});
  EXPECT_EQ(write_again("ptu", 0, {Verdict::failed, "too late again"}).verdict, Verdict::failed);
  EXPECT_EQ(write_again("ptu", 0, {Verdict::passed, ""}).verdict, Verdict::passed);
  EXPECT_EQ(column("ptu"), name(0) + "\tpassed\t3\ttoo late again\n");
  const std::string text = table();
  EXPECT_NE(text.find("| " + name(0) + " | passed at try 3 |\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\nPassed only at a further try; before:\n\n- ptu, " + name(0) + ": too late again\n"),
            std::string::npos)
      << text;
  // Another run.
  write("ptu", 0, {Verdict::passed, ""});
  EXPECT_EQ(column("ptu"), name(0) + "\tpassed\t1\t\n");
}

TEST_F(TableTest, WhatMustNeverBeIsNotTakenBackByAFurtherTry) {
  write("ptu", 0, {Verdict::failed, "it came too late"});
  EXPECT_FALSE(write_again("ptu", 0, {Verdict::failed, "a frame of before", true}).verdict ==
               Verdict::passed);
  const Outcome again = write_again("ptu", 0, {Verdict::passed, ""});
  EXPECT_EQ(again.verdict, Verdict::failed);
  EXPECT_EQ(again.text, "a frame of before");
  EXPECT_TRUE(again.for_good);
  EXPECT_EQ(column("ptu"), name(0) + "\tfailed for good\t3\ta frame of before\n");
  EXPECT_NE(table().find("| " + name(0) + " | **failed** |\n"), std::string::npos) << table();
  write("ptu", 0, {Verdict::passed, ""});
  EXPECT_EQ(column("ptu"), name(0) + "\tpassed\t1\t\n");
}

TEST_F(TableTest, ColumnsOfSeveralFoldersStandSideBySide) {
  write("ptu", 0, {Verdict::passed, ""});
  test::TemporaryFolder other;
  ASSERT_TRUE(write_column(other.path(), "kernel", {{checks().front(), {Verdict::passed, ""}}}).has_value());
  const auto both = table_of({folder_ / "absent", folder_.path(), other.path()});
  ASSERT_TRUE(both.has_value()) << both.error().text();
  EXPECT_EQ(both->find("| check | kernel | ptu |\n"), 0U) << *both;
}

TEST_F(TableTest, ManyAtOnceLoseNoLine) {
  std::vector<std::thread> writers;
  for (std::size_t check = 0; check < checks().size(); ++check) {
    writers.emplace_back([this, check] { write("ptu", check, {Verdict::passed, ""}); });
  }
  for (std::thread& writer : writers) writer.join();
  std::string all;
  for (const Check& check : checks()) all += check.name + "\tpassed\t1\t\n";
  EXPECT_EQ(column("ptu"), all);
}

TEST_F(TableTest, AColumnThatIsNoneIsAnError) {
  test::put_bytes(folder_ / "ptu.tsv", name(0) + "\tperhaps\t1\t\n");
  const auto text = table_of({folder_.path()});
  ASSERT_FALSE(text.has_value());
  EXPECT_EQ(text.error().code, base::ErrorCode::damaged);
  EXPECT_FALSE(write_column(folder_.path(), "ptu", {{checks().front(), {Verdict::passed, ""}}}).has_value());
  EXPECT_FALSE(table_of({folder_ / "absent"}).has_value());
}

}  // namespace
}  // namespace rig::drivers::conformance
