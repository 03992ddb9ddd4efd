// rigd on the network: keys made and allowed by `rig keys`, control that moves between a client far away and
// one on the machine, and a key that is taken away.
#include <gmock/gmock.h>
#include <regex>

#include "protocol/keys.h"
#include "tests/system/running_rig.h"

namespace rig {
namespace {

using ::testing::HasSubstr;

protocol::Request switch_light(double level) {
  protocol::Request request;
  request.mutable_set_light()->set_level(level);
  return request;
}

TEST(Access, KeysControlAndRevocation) {
  const test::TemporaryFolder folder;
  const auto rig_keys = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "keys");
    return test::run_program("rig", arguments, folder / "keys.log");
  };
  const std::string list = folder / "allowed.toml";
  ASSERT_EQ(rig_keys({"make", folder / "rigd.key"}), 0);
  ASSERT_EQ(rig_keys({"make", folder / "anna.key"}), 0);
  EXPECT_EQ(rig_keys({"make", folder / "anna.key"}), 1) << "would overwrite";
  ASSERT_EQ(rig_keys({"allow", "anna", folder / "anna.key.pub", "--list", list}), 0);
  EXPECT_EQ(rig_keys({"allow", "eve", folder / "rigd.key.pub", "--role", "king", "--list", list}), 1);
  EXPECT_EQ(rig_keys({"revoke", "eve", "--list", list}), 1);
  ASSERT_EQ(rig_keys({"list", "--list", list}), 0);
  EXPECT_THAT(test::bytes_in(folder / "keys.log"), HasSubstr("anna                 operator"));

  test::RunningRig rig(folder.path(), test::small_rig_toml() +
                                          "\n[network]\nendpoint = \"tcp://127.0.0.1:*\"\n"
                                          "key_file = \"rigd.key\"\nallow_list = \"allowed.toml\"\n");
  rig.start();
  std::smatch port;
  const std::string log = rig.log();
  ASSERT_TRUE(std::regex_search(log, port, std::regex("tcp://127\\.0\\.0\\.1:[0-9]+"))) << log;
  const auto keys = protocol::read_key_file(folder / "anna.key");
  const auto server = protocol::read_public_key(folder / "rigd.key.pub");
  ASSERT_TRUE(keys.has_value() && server.has_value());
  auto anna = protocol::Client::connect(port.str(), {*keys, *server});
  ASSERT_TRUE(anna.has_value());

  const auto lit = anna->ask(switch_light(1), test::kPatience);
  ASSERT_TRUE(lit.has_value()) << lit.error().text();
  EXPECT_EQ(lit->outcome(), protocol::DONE);
  EXPECT_TRUE(rig.await([](const protocol::Event& event) {
    return event.has_control_changed() && event.control_changed().holder() == "anna";
  }));
  EXPECT_EQ(rig.ask(switch_light(0)).outcome(), protocol::REFUSED)
      << "also of an admin, before it takes control";
  protocol::Request take;
  take.mutable_take_control();
  EXPECT_THAT(rig.expect_done(take).control().holder(), HasSubstr("local/"));
  EXPECT_EQ(anna->ask(switch_light(1), test::kPatience)->outcome(), protocol::REFUSED);

  // Who holds control is remembered.
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
  rig.start();
  protocol::Request show;
  show.mutable_get_control();
  EXPECT_THAT(rig.expect_done(show).control().holder(), HasSubstr("local/"));

  // Another port now; the program itself as the client.
  const std::string again = rig.log().substr(log.size());
  ASSERT_TRUE(std::regex_search(again, port, std::regex("tcp://127\\.0\\.0\\.1:[0-9]+"))) << again;
  const auto far = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--endpoint", port.str()});
    return test::run_program("rig", arguments, folder / "far.log");
  };
  ::unsetenv("RIG_KEY");
  EXPECT_EQ(far({"status"}), 1);
  EXPECT_THAT(test::bytes_in(folder / "far.log"), HasSubstr("RIG_KEY"));
  ASSERT_EQ(::setenv("RIG_KEY", (folder / "anna.key").c_str(), 1), 0);
  ASSERT_EQ(::setenv("RIG_SERVER_KEY", (folder / "rigd.key.pub").c_str(), 1), 0);
  EXPECT_EQ(far({"control", "show"}), 0);
  EXPECT_EQ(far({"control", "take"}), 1);
  EXPECT_THAT(test::bytes_in(folder / "far.log"), HasSubstr("holds control"));
  EXPECT_EQ(far({"stop", "--reason", "smoke"}), 0) << "needs no control";
  ASSERT_EQ(rig_keys({"revoke", "anna", "--list", list}), 0);
  EXPECT_EQ(far({"status"}), 1);
  EXPECT_THAT(test::bytes_in(folder / "far.log"), HasSubstr("does not allow this key"));
  EXPECT_EQ(rig.end(SIGTERM), 0);
}

}  // namespace
}  // namespace rig
