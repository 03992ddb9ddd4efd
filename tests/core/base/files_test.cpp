// Files that are there whole or not at all, and the hash that proves them.
#include "core/base/files.h"

#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/hash.h"

namespace rig::base {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

class Files : public testing::Test {
 protected:
  Files() {
    std::string pattern = (fs::temp_directory_path() / "rigd-files-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~Files() override { fs::remove_all(folder_); }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  [[nodiscard]] std::vector<std::string> entries() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      out.push_back(fs::relative(entry.path(), folder_).string());
    }
    return out;
  }

  fs::path folder_;
};

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

TEST_F(Files, WritesAndReadsBackEveryByte) {
  std::string all;
  for (int i = 0; i < 256 * 4096; ++i) all += static_cast<char>(i % 256);
  ASSERT_TRUE(write_file_durably(folder_ / "all", all).has_value());
  EXPECT_EQ(read_file(folder_ / "all"), all);
  ASSERT_TRUE(write_file_durably(folder_ / "empty", "").has_value());
  EXPECT_EQ(read_file(folder_ / "empty"), "");
  EXPECT_THAT(entries(), UnorderedElementsAre("all", "empty")) << "nothing beside them";
}

TEST_F(Files, ReplacesAnEarlierFileAndAnEarlierPart) {
  ASSERT_TRUE(
      write_and_flush(folder_ / "a.part", bytes_of("of a crash, longer than what comes")).has_value());
  ASSERT_TRUE(write_file_durably(folder_ / "a", "long first content").has_value());
  ASSERT_TRUE(write_file_durably(folder_ / "a", "second").has_value());
  EXPECT_EQ(read_file(folder_ / "a"), "second");
  EXPECT_THAT(entries(), UnorderedElementsAre("a"));
}

TEST_F(Files, AMissingFolderIsAnErrorThatNamesThePath) {
  const auto written = write_file_durably(folder_ / "none" / "a", "text");
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, ErrorCode::not_found);
  EXPECT_THAT(written.error().where, HasSubstr("none/a"));
  EXPECT_THAT(entries(), UnorderedElementsAre());
}

TEST_F(Files, AFullDiskIsAnErrorWithAdvice) {
  // The device of Linux that is always full.
  const auto written = write_and_flush("/dev/full", bytes_of("text"));
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, ErrorCode::io);
  EXPECT_THAT(written.error().text(), HasSubstr("/dev/full"));
  EXPECT_THAT(written.error().hint, HasSubstr("free space"));
}

TEST_F(Files, ReadingWhatIsNoFile) {
  const auto missing = read_file(folder_ / "missing");
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  const auto a_folder = read_file(folder_);
  ASSERT_FALSE(a_folder.has_value());
  EXPECT_EQ(a_folder.error().code, ErrorCode::bad_input);
}

TEST_F(Files, RenamesAFolderOverOneThatHoldsSomething) {
  fs::create_directories(folder_ / "row.part");
  fs::create_directories(folder_ / "row");
  ASSERT_TRUE(write_and_flush(folder_ / "row.part" / "new", bytes_of("n")).has_value());
  ASSERT_TRUE(write_and_flush(folder_ / "row" / "old", bytes_of("o")).has_value());
  ASSERT_TRUE(rename_durably(folder_ / "row.part", folder_ / "row").has_value());
  EXPECT_THAT(entries(), UnorderedElementsAre("row", "row/new"));
}

TEST_F(Files, RenamesBetweenFolders) {
  fs::create_directories(folder_ / "a");
  fs::create_directories(folder_ / "b");
  ASSERT_TRUE(write_and_flush(folder_ / "a" / "x", bytes_of("1")).has_value());
  ASSERT_TRUE(write_and_flush(folder_ / "b" / "x", bytes_of("2")).has_value());
  ASSERT_TRUE(rename_durably(folder_ / "a" / "x", folder_ / "b" / "x").has_value());
  EXPECT_THAT(entries(), UnorderedElementsAre("a", "b", "b/x"));
  EXPECT_EQ(read_file(folder_ / "b" / "x"), "1");
}

TEST_F(Files, ARenameThatFailsChangesNothing) {
  ASSERT_TRUE(write_and_flush(folder_ / "there", bytes_of("1")).has_value());
  const auto renamed = rename_durably(folder_ / "missing", folder_ / "there");
  ASSERT_FALSE(renamed.has_value());
  EXPECT_EQ(renamed.error().code, ErrorCode::not_found);
  EXPECT_EQ(read_file(folder_ / "there"), "1");
}

TEST_F(Files, FlushingAFolderThatIsNone) {
  EXPECT_TRUE(flush_folder(folder_).has_value());
  EXPECT_FALSE(flush_folder(folder_ / "none").has_value());
}

// FIPS 180-4's examples, as NIST publishes them.
TEST(Sha256, KnownVectors) {
  EXPECT_EQ(sha256_hex(bytes_of("")), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex(bytes_of("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex(bytes_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST_F(Files, HashingInPiecesAndFromAFileIsHashingTheWhole) {
  const std::string million(1'000'000, 'a');
  const std::string expected = "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";
  Sha256 hash;
  for (std::size_t at = 0; at < million.size(); at += 999) {
    hash.add(bytes_of(std::string_view(million).substr(at, 999)));
  }
  EXPECT_EQ(hash.finish(), expected);
  // Longer than the buffer that files are read through.
  const std::string three = million + million + million;
  ASSERT_TRUE(write_file_durably(folder_ / "a", three).has_value());
  EXPECT_EQ(sha256_of_file(folder_ / "a"), sha256_hex(bytes_of(three)));
  EXPECT_FALSE(sha256_of_file(folder_ / "missing").has_value());
}

}  // namespace
}  // namespace rig::base
