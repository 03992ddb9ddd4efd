#include "sim/state_file.h"

#include <cstring>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::sim {
namespace {

Memory some_memory(std::uint64_t key) {
  base::Random random(key);
  Memory memory;
  memory.made = 1;
  memory.now_ns = static_cast<std::int64_t>(random.bits() >> 2);
  for (AxisMemory& axis : memory.axes) {
    axis.from_rad = random.uniform(-3, 3);
    axis.to = static_cast<std::int64_t>(random.below(100000));
    axis.homed = static_cast<std::int32_t>(random.below(2));
  }
  memory.lamp_hours = random.uniform(0, 1000);
  return memory;
}

bool same(const Memory& a, const Memory& b) {
  return std::memcmp(&a, &b, sizeof(Memory)) == 0;
}

TEST(StateFile, BeginsEmptyAndRemembersTheLast) {
  const test::TemporaryFolder folder;
  {
    auto file = StateFile::open(folder / "state");
    ASSERT_TRUE(file.has_value());
    EXPECT_EQ(file->load().made, 0);
    for (std::uint64_t i = 0; i < 7; ++i) {
      file->store(some_memory(i));
      EXPECT_TRUE(same(file->load(), some_memory(i)));
    }
    EXPECT_TRUE(file->flush().has_value());
  }
  const auto file = StateFile::open(folder / "state");
  ASSERT_TRUE(file.has_value());
  EXPECT_TRUE(same(file->load(), some_memory(6)));
}

// Any mixture of the file before and after a store is the one or the other.
TEST(StateFile, ATornStoreIsTheOldStateOrTheNew) {
  const test::TemporaryFolder folder;
  base::Random random(test::seed(31));
  int olds = 0;
  int news = 0;
  for (std::uint64_t round = 0; round < 200; ++round) {
    const auto path = folder / ("state" + std::to_string(round));
    const std::uint64_t stores = 1 + random.below(4);
    auto file = StateFile::open(path);
    ASSERT_TRUE(file.has_value());
    for (std::uint64_t i = 0; i < stores; ++i) file->store(some_memory(1000 + i));
    const Memory before = file->load();
    const std::string old_bytes = test::bytes_in(path);
    file->store(some_memory(round));
    const std::string new_bytes = test::bytes_in(path);
    ASSERT_EQ(old_bytes.size(), new_bytes.size());
    std::string torn = old_bytes;
    const std::size_t piece = 8 << random.below(6);
    const std::uint64_t share = random.below(11);
    for (std::size_t at = 0; at < torn.size(); at += piece) {
      if (random.below(10) < share) {
        torn.replace(at, std::min(piece, torn.size() - at), new_bytes.substr(at, piece));
      }
    }
    test::put_bytes(folder / "torn", torn);
    const auto reopened = StateFile::open(folder / "torn");
    ASSERT_TRUE(reopened.has_value()) << reopened.error().text();
    const bool is_old = same(reopened->load(), before);
    const bool is_new = same(reopened->load(), some_memory(round));
    EXPECT_TRUE(is_old || is_new);
    olds += is_old ? 1 : 0;
    news += is_new ? 1 : 0;
  }
  EXPECT_GT(olds, 20);
  EXPECT_GT(news, 10);
}

TEST(StateFile, OneDamagedSlotCostsOneStoreAndTwoAreAnError) {
  const test::TemporaryFolder folder;
  {
    auto file = StateFile::open(folder / "state");
    ASSERT_TRUE(file.has_value());
    file->store(some_memory(1));
    file->store(some_memory(2));
  }
  const std::string whole = test::bytes_in(folder / "state");
  const std::size_t slot = whole.size() / 2;
  const auto damaged = [&](bool first, bool second) {
    std::string bytes = whole;
    if (first) bytes[slot / 2] = static_cast<char>(bytes[slot / 2] ^ 1);
    if (second) bytes[slot + slot / 2] = static_cast<char>(bytes[slot + slot / 2] ^ 1);
    test::put_bytes(folder / "damaged", bytes);
    return StateFile::open(folder / "damaged");
  };
  EXPECT_TRUE(same(damaged(true, false)->load(), some_memory(2)));
  EXPECT_TRUE(same(damaged(false, true)->load(), some_memory(1)));
  const auto both = damaged(true, true);
  ASSERT_FALSE(both.has_value());
  EXPECT_EQ(both.error().code, base::ErrorCode::damaged);
}

TEST(StateFile, SaysWhereItCannotBe) {
  const auto file = StateFile::open("/nowhere/state");
  ASSERT_FALSE(file.has_value());
  EXPECT_NE(file.error().text().find("/nowhere/state"), std::string::npos);
}

}  // namespace
}  // namespace rig::sim
