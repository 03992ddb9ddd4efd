// Keys in files, and the list of those that are allowed.
#include "protocol/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/base/files.h"
#include "protocol/allow_list.h"
#include "tests/core/temporary_folder.h"

namespace rig::protocol {
namespace {

namespace fs = std::filesystem;
using base::ErrorCode;
using ::testing::HasSubstr;

template <typename T>
void expect_error(const base::Result<T>& result, ErrorCode code, const std::string& said) {
  ASSERT_FALSE(result.has_value()) << said;
  EXPECT_EQ(result.error().code, code) << result.error().text();
  EXPECT_THAT(result.error().text(), HasSubstr(said));
}

TEST(Keys, ArePairsOf40Letters) {
  const auto one = make_key_pair();
  const auto two = make_key_pair();
  ASSERT_TRUE(one.has_value() && two.has_value());
  EXPECT_TRUE(is_key(one->public_key) && is_key(one->secret_key));
  EXPECT_NE(one->secret_key, two->secret_key);
  for (const std::string& none : {std::string(), std::string(39, 'a'), std::string(41, 'a'),
                                  std::string(40, ' '), std::string(40, '\0'), std::string(40, '"')}) {
    EXPECT_FALSE(is_key(none)) << none;
  }
}

TEST(Keys, AFileIsForItsOwnerAloneAndIsReadBack) {
  const test::TemporaryFolder folder;
  const auto keys = make_key_pair().value();
  ASSERT_TRUE(write_key_files(folder / "anna.key", keys).has_value());
  struct stat info {};
  ASSERT_EQ(::stat((folder / "anna.key").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0600U);
  const auto read = read_key_file(folder / "anna.key");
  ASSERT_TRUE(read.has_value()) << read.error().text();
  EXPECT_EQ(read->public_key, keys.public_key);
  EXPECT_EQ(read->secret_key, keys.secret_key);
  EXPECT_EQ(read_public_key((folder / "anna.key.pub").string()).value(), keys.public_key);
  EXPECT_EQ(read_public_key(keys.public_key).value(), keys.public_key);
  EXPECT_THAT(base::read_file(folder / "anna.key.pub").value(), Not(HasSubstr(keys.secret_key)));
}

TEST(Keys, AreNeverOverwritten) {
  const test::TemporaryFolder folder;
  const auto keys = make_key_pair().value();
  ASSERT_TRUE(write_key_files(folder / "a", keys).has_value());
  const std::string before = base::read_file(folder / "a").value();
  expect_error(write_key_files(folder / "a", make_key_pair().value()), ErrorCode::refused,
               "never overwritten");
  fs::remove(folder / "a.pub");
  expect_error(write_key_files(folder / "a", make_key_pair().value()), ErrorCode::refused,
               "never overwritten");
  EXPECT_EQ(base::read_file(folder / "a").value(), before);
  EXPECT_FALSE(fs::exists(folder / "a.pub")) << "of a pair that was not made";
  expect_error(write_key_files(folder / "none" / "a", keys), ErrorCode::io, "cannot make the file");
}

TEST(Keys, AFileThatOthersMayReadIsNotUsed) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_key_files(folder / "a", make_key_pair().value()).has_value());
  for (const mode_t mode : {0640U, 0604U, 0666U}) {
    ASSERT_EQ(::chmod((folder / "a").c_str(), mode), 0);
    expect_error(read_key_file(folder / "a"), ErrorCode::refused, "chmod 600");
  }
  expect_error(read_key_file(folder / "b"), ErrorCode::not_found, "rig keys make");
}

TEST(Keys, AFileThatIsNoneSaysWhy) {
  const test::TemporaryFolder folder;
  const auto write = [&](const std::string& text) {
    const fs::path path = folder / "a";
    EXPECT_TRUE(base::write_file_durably(path, text).has_value());
    EXPECT_EQ(::chmod(path.c_str(), 0600), 0);
    return read_key_file(path);
  };
  const auto one = make_key_pair().value();
  const auto two = make_key_pair().value();
  const auto file = [](const std::string& open, const std::string& secret) {
    return "format = 1\npublic_key = \"" + open + "\"\nsecret_key = \"" + secret + "\"\n";
  };
  expect_error(write("what?"), ErrorCode::bad_input, "a:1");
  expect_error(write(file("short", one.secret_key)), ErrorCode::bad_input, "40 letters");
  expect_error(write(file(one.public_key, two.secret_key)), ErrorCode::damaged, "does not belong");
  expect_error(write("format = 9\n"), ErrorCode::newer, "format 9");
}

TEST(Keys, TheSecretOneIsNotTakenForThePublicOne) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_key_files(folder / "a", make_key_pair().value()).has_value());
  expect_error(read_public_key((folder / "a").string()), ErrorCode::refused, ".pub");
  expect_error(read_public_key("nothing"), ErrorCode::not_found, "neither a public key");
}

// ---- The list

TEST(AllowList, IsWrittenAndReadBack) {
  const test::TemporaryFolder folder;
  const fs::path list = folder / "allowed.toml";
  const std::string anna = make_key_pair()->public_key;
  const std::string ben = make_key_pair()->public_key;
  ASSERT_TRUE(allow_key(list, {"anna", anna, Role::operator_}).has_value());
  ASSERT_TRUE(allow_key(list, {"ben@home.org", ben, Role::admin}).has_value());
  auto read = read_allow_list(list);
  ASSERT_TRUE(read.has_value()) << read.error().text();
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].name, "anna");
  EXPECT_EQ((*read)[0].public_key, anna);
  EXPECT_EQ((*read)[0].role, Role::operator_);
  EXPECT_EQ((*read)[1].role, Role::admin);

  expect_error(allow_key(list, {"anna", make_key_pair()->public_key, Role::observer}), ErrorCode::refused,
               "anna");
  expect_error(allow_key(list, {"carl", anna, Role::observer}), ErrorCode::refused, "as 'anna'");
  expect_error(allow_key(list, {"local/carl", make_key_pair()->public_key, Role::observer}),
               ErrorCode::bad_input, "letters, digits");
  expect_error(allow_key(list, {"carl", "no key", Role::observer}), ErrorCode::bad_input, "no public key");

  expect_error(revoke_key(list, "carl"), ErrorCode::not_found, "carl");
  EXPECT_EQ(revoke_key(list, "anna").value().public_key, anna);
  EXPECT_EQ(revoke_key(list, ben).value().name, "ben@home.org");
  EXPECT_TRUE(read_allow_list(list)->empty());
}

TEST(AllowList, TellsEveryMistakeWithItsLine) {
  const std::string key = make_key_pair()->public_key;
  const auto entry = [](const std::string& name, const std::string& open, const std::string& role) {
    return "[[key]]\nname = \"" + name + "\"\npublic_key = \"" + open + "\"\nrole = \"" + role + "\"\n";
  };
  const auto parse = [](const std::string& rest) { return parse_allow_list("format = 1\n" + rest, "list"); };
  EXPECT_TRUE(parse("").has_value());
  EXPECT_TRUE(parse(entry("a", key, "observer")).has_value());
  expect_error(parse(entry("", key, "observer")), ErrorCode::bad_input, "list:3");
  expect_error(parse(entry("a", "abc", "observer")), ErrorCode::bad_input, "list:4");
  expect_error(parse(entry("a", key, "king")), ErrorCode::bad_input, "list:5");
  expect_error(parse(entry("a", key, "admin") + entry("b", key, "observer")), ErrorCode::bad_input, "twice");
  expect_error(parse(entry("a", key, "admin") + entry("a", make_key_pair()->public_key, "admin")),
               ErrorCode::bad_input, "twice");
  expect_error(parse("keys = 1\n"), ErrorCode::bad_input, "keys");
  expect_error(parse_allow_list("format = 2\n", "list"), ErrorCode::newer, "format 2");
  expect_error(read_allow_list("/nonexistent/list"), ErrorCode::not_found, "rig keys allow");
}

}  // namespace
}  // namespace rig::protocol
