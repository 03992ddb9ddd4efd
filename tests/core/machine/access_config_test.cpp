// [network], [sockets] and [control] of rig.toml.
#include "core/machine/access_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/machine/rig_file.h"

namespace rig::machine {
namespace {

using ::testing::HasSubstr;

base::Result<RigConfig> with(const std::string& tables) {
  return parse_rig_config(shipped_rig_text() + "\n" + tables, "rig.toml");
}
void expect_mistake(const std::string& tables, const std::string& said) {
  const auto rig = with(tables);
  ASSERT_FALSE(rig.has_value()) << tables;
  EXPECT_THAT(rig.error().text(), HasSubstr(said)) << tables;
}

TEST(AccessConfig, WithoutTheTablesThereAreLocalSocketsOnly) {
  const auto rig = with("");
  ASSERT_TRUE(rig.has_value());
  EXPECT_FALSE(rig->access.network.has_value());
  EXPECT_EQ(rig->access.observe_group, "");
  EXPECT_EQ(rig->access.release_after_s, 60);
}

TEST(AccessConfig, IsReadWhole) {
  const auto rig = with(
      "[network]\nendpoint = \"tcp://[::]:4400\"\nkey_file = \"rigd.key\"\nallow_list = \"allowed.toml\"\n"
      "[sockets]\nobserve_group = \"rig-observe\"\noperate_group = \"rig-operate\"\n"
      "[control]\nrelease_after_s = 20\n");
  ASSERT_TRUE(rig.has_value()) << rig.error().text();
  ASSERT_TRUE(rig->access.network.has_value());
  EXPECT_EQ(rig->access.network->endpoint, "tcp://[::]:4400");
  EXPECT_EQ(rig->access.network->key_file, "rigd.key");
  EXPECT_EQ(rig->access.network->allow_list, "allowed.toml");
  EXPECT_EQ(rig->access.observe_group, "rig-observe");
  EXPECT_EQ(rig->access.operate_group, "rig-operate");
  EXPECT_EQ(rig->access.release_after_s, 20);
}

TEST(AccessConfig, MistakesNameTheirKey) {
  const std::string files = "key_file = \"a\"\nallow_list = \"b\"\n";
  for (const char* endpoint : {"ipc:///run/x", "tcp://", "tcp://1.2.3.4", "tcp://:4400", "tcp://h:0",
                               "tcp://h:65536", "tcp://h:44x", "h:4400", ""}) {
    expect_mistake("[network]\nendpoint = \"" + std::string(endpoint) + "\"\n" + files, "network.endpoint");
  }
  expect_mistake("[network]\nendpoint = \"tcp://*:1\"\nallow_list = \"b\"\n", "key_file");
  expect_mistake("[network]\nendpoint = \"tcp://*:1\"\nkey_file = \"\"\nallow_list = \"b\"\n",
                 "names no file");
  expect_mistake("[sockets]\nadmin_group = \"wheel\"\n", "admin_group");
  expect_mistake("[control]\nrelease_after_s = 1\n", "release_after_s");
}

}  // namespace
}  // namespace rig::machine
