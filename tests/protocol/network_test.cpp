// The network's door on real sockets: who gets in, who does not, and how one who was in is shut out.
#include <arpa/inet.h>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <random>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/files.h"
#include "protocol/allow_list.h"
#include "protocol/client.h"
#include "protocol/doors.h"
#include "protocol/handshake_watch.h"
#include "protocol/keys.h"
#include "protocol/local_peer.h"
#include "tests/core/seed.h"
#include "tests/protocol/raw_client.h"

namespace rig::protocol {
namespace {

namespace fs = std::filesystem;
using namespace rig::protocol::testing;
using base::ErrorCode;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

void set_keys(const Socket& socket, const KeyPair& own, const std::string& server) {
  EXPECT_TRUE(socket.require(ZMQ_CURVE_SERVERKEY, server));
  EXPECT_TRUE(socket.require(ZMQ_CURVE_PUBLICKEY, own.public_key));
  EXPECT_TRUE(socket.require(ZMQ_CURVE_SECRETKEY, own.secret_key));
}

class NetworkTest : public ::testing::Test {
 protected:
  NetworkTest() {
    EXPECT_TRUE(write_key_files(folder_ / "rigd.key", rigd_).has_value());
    EXPECT_TRUE(allow_key(list_, {"anna", anna_.public_key, Role::operator_}).has_value());
    EXPECT_TRUE(allow_key(list_, {"ben", ben_.public_key, Role::observer}).has_value());
    options_.network = NetworkDoor{"tcp://127.0.0.1:*", folder_ / "rigd.key", list_};
    options_.revoked = [this](const std::string& name) { revoked_.set_value(name); };
  }

  [[nodiscard]] std::unique_ptr<RawClient> raw(const TestServer& server, const KeyPair& own,
                                               const std::string& routing = {}) const {
    return std::make_unique<RawClient>(server.server().network_endpoint(), 1000,
                                       [&](const Context&, const Socket& socket) {
                                         set_keys(socket, own, rigd_.public_key);
                                         if (!routing.empty()) {
                                           EXPECT_TRUE(socket.require(ZMQ_ROUTING_ID, routing));
                                         }
                                       });
  }
  static Request ping() {
    Request request;
    request.mutable_get_status();
    return request;
  }
  base::Result<Reply> ask_as(const TestServer& server, const KeyPair& own) const {
    auto client = Client::connect(server.server().network_endpoint(), ClientKeys{own, rigd_.public_key});
    if (!client) return base::pass(client);
    return client->ask(ping(), kPatience);
  }
  void write_list(const std::string& text) const {
    ASSERT_TRUE(base::write_file_durably(list_, text).has_value());
  }
  [[nodiscard]] std::string await_revoked() {
    auto told = revoked_.get_future();
    EXPECT_EQ(told.wait_for(kPatience), std::future_status::ready);
    const std::string name = told.get();
    revoked_ = {};
    return name;
  }

  const test::TemporaryFolder folder_;
  const fs::path list_ = folder_ / "allowed.toml";
  const KeyPair rigd_ = make_key_pair().value();
  const KeyPair anna_ = make_key_pair().value();
  const KeyPair ben_ = make_key_pair().value();
  const KeyPair stranger_ = make_key_pair().value();
  ServerOptions options_;
  std::promise<std::string> revoked_;
};

// ---- The four rows

TEST_F(NetworkTest, AKnownKeyIsLetInUnderItsNameAndRole) {
  const TestServer server(options_);
  ASSERT_TRUE(ask_as(server, anna_).has_value());
  ASSERT_TRUE(ask_as(server, ben_).has_value());
  const auto taken = server.taken();
  ASSERT_EQ(taken.size(), 2U);
  EXPECT_EQ(taken[0].who, "anna");
  EXPECT_EQ(taken[0].role, Role::operator_);
  EXPECT_EQ(taken[1].who, "ben");
  EXPECT_EQ(taken[1].role, Role::observer);
}

TEST_F(NetworkTest, AnUnknownKeyIsTurnedAwayAndToldSo) {
  const TestServer server(options_);
  const auto reply = ask_as(server, stranger_);
  ASSERT_FALSE(reply.has_value());
  EXPECT_EQ(reply.error().code, ErrorCode::refused);
  EXPECT_THAT(reply.error().text(), HasSubstr("rig keys allow"));
  EXPECT_TRUE(ask_as(server, anna_).has_value()) << "others are not harmed";
  EXPECT_EQ(server.taken().size(), 1U);
}

// A client of the network door whose handshake fails, as it sees it itself.
void expect_broken_off(const std::string& endpoint, const std::function<void(const Socket&)>& prepare) {
  std::optional<RawClient> client;
  std::optional<HandshakeWatch> watch;  // ends before the client's context does
  client.emplace(endpoint, 1000, [&](const Context& context, const Socket& socket) {
    prepare(socket);
    auto started = HandshakeWatch::start(context, socket);
    ASSERT_TRUE(started.has_value());
    watch.emplace(std::move(*started));
  });
  client->ping(1);
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!watch->broken_off() && std::chrono::steady_clock::now() < end) {
    zmq_pollitem_t item{watch->handle(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, 100);
    watch->read();
  }
  EXPECT_TRUE(watch->broken_off());
  EXPECT_FALSE(client->next_within(milliseconds(0)).has_value());
}

TEST_F(NetworkTest, APlainClientDoesNotGetIn) {
  const TestServer server(options_);
  expect_broken_off(server.server().network_endpoint(), [](const Socket&) {});
  EXPECT_TRUE(server.taken().empty());
}

TEST_F(NetworkTest, WithoutAHandlerNobodyGetsIn) {
  const Context context;
  const auto door = open_network_door(context, options_);
  ASSERT_TRUE(door.has_value()) << door.error().text();
  expect_broken_off(door->endpoint, [&](const Socket& socket) { set_keys(socket, anna_, rigd_.public_key); });
  EXPECT_FALSE(receive(door->socket).has_value());
}

TEST_F(NetworkTest, AClientDoesNotTalkToAnotherThanTheRigdItKnows) {
  const TestServer server(options_);
  expect_broken_off(server.server().network_endpoint(),
                    [&](const Socket& socket) { set_keys(socket, anna_, stranger_.public_key); });
  EXPECT_TRUE(server.taken().empty());
}

// ---- Revocation, with the connection open

TEST_F(NetworkTest, ARevokedClientGetsARefusalAndNothingMore) {
  std::promise<ClientId> withheld;
  const TestServer server(options_, [&](Server& at, const Incoming& in) {
    if (in.request.id() == 7) {
      withheld.set_value(in.client);
    } else {
      TestServer::done(at, in);
    }
  });
  const auto anna = raw(server, anna_);
  const auto ben = raw(server, ben_);
  const ClientId anna_here = server.greet(*anna, 1);
  const ClientId ben_here = server.greet(*ben, 2);
  server.server().subscribe(anna_here, PreviewWish{});
  server.server().subscribe(ben_here, PreviewWish{});
  server.server().publish(event_of(1));
  EXPECT_EQ(anna->next().event().number(), 1U);
  EXPECT_EQ(ben->next().event().number(), 1U);
  anna->ping(7);  // is answered only after she was shut out
  const ClientId waits = withheld.get_future().get();

  ASSERT_TRUE(revoke_key(list_, "anna").has_value());
  EXPECT_EQ(await_revoked(), "anna");
  server.server().publish(event_of(2));
  server.server().publish_preview(preview_of(1));
  Reply late;
  late.set_id(7);
  late.set_outcome(DONE);
  server.server().reply(waits, late);
  server.server().subscribe(anna_here, PreviewWish{});
  EXPECT_EQ(ben->next().event().number(), 2U);
  EXPECT_TRUE(ben->next().event().has_preview());

  anna->ping(8);
  const Message refusal = anna->next();
  EXPECT_EQ(refusal.reply().id(), 8U) << refusal.ShortDebugString();
  EXPECT_EQ(refusal.reply().outcome(), REFUSED);
  EXPECT_THAT(refusal.reply().reason(), HasSubstr("not allowed"));
  server.server().publish(event_of(3));
  EXPECT_EQ(ben->next().event().number(), 3U);
  anna->ping(9);
  EXPECT_EQ(anna->next().reply().id(), 9U) << "the third event did not come before";
  EXPECT_EQ(server.taken().size(), 3U) << "her later requests went no further than the door";
  EXPECT_EQ(ask_as(server, anna_).error().code, ErrorCode::refused) << "nor may she come again";
}

TEST_F(NetworkTest, ARoleIsLookedUpForEachMessage) {
  const TestServer server(options_);
  const auto anna = raw(server, anna_);
  (void)server.greet(*anna, 1);
  ASSERT_TRUE(revoke_key(list_, "ben").has_value());  // so that the next look at the list is seen
  ASSERT_TRUE(write_allow_list(list_, {{"anna", anna_.public_key, Role::observer}}).has_value());
  EXPECT_EQ(await_revoked(), "ben");
  (void)server.greet(*anna, 2);
  EXPECT_EQ(server.taken().back().role, Role::observer);
}

TEST_F(NetworkTest, AListThatCannotBeReadAllowsNobodyUntilItIsMended) {
  const TestServer server(options_);
  const auto anna = raw(server, anna_);
  (void)server.greet(*anna, 1);
  ASSERT_TRUE(revoke_key(list_, "ben").has_value());
  EXPECT_EQ(await_revoked(), "ben");
  const std::string good = base::read_file(list_).value();
  write_list("format = 1\n[[key");
  EXPECT_EQ(await_revoked(), "anna");
  anna->ping(2);
  EXPECT_EQ(anna->next().reply().outcome(), REFUSED);
  write_list(good);
  anna->ping(3);
  EXPECT_EQ(anna->next().reply().outcome(), DONE);
}

// A routing id is chosen by the client; it gives nobody what was meant for another.
TEST_F(NetworkTest, ARoutingIdIsNoIdentity) {
  const TestServer server(options_);
  auto anna = raw(server, anna_, "the same");
  server.server().subscribe(server.greet(*anna, 1), std::nullopt);
  EXPECT_EQ(server.taken().back().who, "anna");
  server.server().publish(event_of(1));
  EXPECT_EQ(anna->next().event().number(), 1U);
  anna.reset();
  const auto ben = raw(server, ben_, "the same");
  EXPECT_EQ(server.greet(*ben, 2).key, ben_.public_key);
  EXPECT_EQ(server.taken().back().who, "ben");
  server.server().publish(event_of(2));
  ben->ping(3);
  EXPECT_EQ(ben->next().reply().id(), 3U) << "no event of a subscription that was anna's";
}

// ---- Start

TEST_F(NetworkTest, DoesNotStartWithoutItsFiles) {
  const test::TemporaryFolder elsewhere;
  options_.folder = elsewhere.path();
  const auto started = [&] { return Server::start(options_, [](const Incoming&) {}); };
  options_.network->allow_list = folder_ / "none.toml";
  EXPECT_THAT(started().error().text(), HasSubstr("rig keys allow"));
  options_.network->allow_list = list_;
  ASSERT_EQ(::chmod((folder_ / "rigd.key").c_str(), 0644), 0);
  EXPECT_THAT(started().error().text(), HasSubstr("chmod 600"));
  ASSERT_EQ(::chmod((folder_ / "rigd.key").c_str(), 0600), 0);
  options_.network->endpoint = "tcp://192.0.2.1:4400";
  EXPECT_THAT(started().error().text(), HasSubstr("cannot listen"));
  options_.network->endpoint = "tcp://127.0.0.1:*";
  EXPECT_TRUE(started().has_value());
}

// ---- Rubbish

TEST_F(NetworkTest, RandomBytesAtThePortDoNoHarm) {
  const TestServer server(options_);
  const std::string endpoint = server.server().network_endpoint();
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::mt19937_64 random(test::seed(61));
  // The greeting of ZMTP 3.1 with CURVE, so that the bytes behind it are read as a handshake's.
  std::string greeting = std::string("\xff\0\0\0\0\0\0\0\1\x7f\3\1", 12) + "CURVE";
  greeting.resize(64, '\0');
  for (int round = 0; round < 300; ++round) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    ASSERT_GE(fd, 0);
    ASSERT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    std::string bytes = round % 3 == 0 ? "" : greeting;
    if (round % 3 == 2) bytes += std::string("\4\xc8\5HELLO", 8);  // a command of 200 bytes that is none
    for (std::uint64_t i = random() % 400; i > 0; --i) bytes += static_cast<char>(random());
    (void)::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    ::close(fd);
  }
  EXPECT_TRUE(ask_as(server, anna_).has_value());
  EXPECT_EQ(server.taken().size(), 1U);
}

TEST_F(NetworkTest, RandomFramesOfAKnownClientAreRefusedOneByOne) {
  const TestServer server(options_);
  const auto ben = raw(server, ben_);
  std::mt19937_64 random(test::seed(62));
  constexpr int kRounds = 500;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::string> frames(1 + random() % 3);
    for (std::string& frame : frames) {
      for (std::uint64_t i = random() % 60; i > 0; --i) frame += static_cast<char>(random());
    }
    if (random() % 2 == 0) frames[0] = kMagic;
    ben->send({frames.begin(), frames.end()});
  }
  for (int round = 0; round < kRounds; ++round) {
    ASSERT_EQ(ben->next().reply().outcome(), REFUSED);
  }
  (void)server.greet(*ben, 9999);
}

// ---- Local sockets: the kernel says who it is

TEST(LocalPeer, IsReadFromTheEndOfTheAddress) {
  EXPECT_EQ(peer_uid("localhost:1000:1001:4711"), uid_t{1000});
  EXPECT_EQ(peer_uid("::1:0:0:1"), uid_t{0});
  for (const char* none : {"", "localhost", "localhost:1:2", ":x:2:3", "h:1:2:", "h:-1:2:3", "127.0.0.1"}) {
    EXPECT_FALSE(peer_uid(none).has_value()) << none;
  }
}

TEST(LocalPeer, IsTheUserOfTheProcessThatConnected) {
  const TestServer server;
  const RawClient client(server.operate());
  (void)server.greet(client, 1);
  const passwd* me = ::getpwuid(::geteuid());
  const std::string name = me != nullptr ? me->pw_name : "uid-" + std::to_string(::geteuid());
  EXPECT_EQ(server.taken().back().who, "local/" + name);
  EXPECT_EQ(server.taken().back().role, Role::admin);
}

TEST(LocalPeer, AnotherUserIsAnOperatorWhereItMayConnect) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  constexpr uid_t kSomebody = 64321;
  const TestServer server;
  ASSERT_EQ(::chmod(server.folder().c_str(), 0755), 0);
  std::optional<RawClient> client;
  std::optional<HandshakeWatch> watch;
  ASSERT_EQ(::seteuid(kSomebody), 0);
  client.emplace(server.operate(), 1000, [&](const Context& context, const Socket& socket) {
    auto started = HandshakeWatch::start(context, socket);
    if (started) watch.emplace(std::move(*started));
  });
  zmq_pollitem_t connected{watch->handle(), 0, ZMQ_POLLIN, 0};
  const int events = zmq_poll(&connected, 1, 20000);
  ASSERT_EQ(::seteuid(0), 0);
  ASSERT_EQ(events, 1);
  (void)server.greet(*client, 1);
  EXPECT_EQ(server.taken().back().who, "local/uid-64321");
  EXPECT_EQ(server.taken().back().role, Role::operator_);
}

TEST(LocalSockets, AreGivenToTheirGroups) {
  ServerOptions options;
  options.observe_group = "no such group";
  const test::TemporaryFolder folder;
  options.folder = folder.path();
  const auto none = Server::start(options, [](const Incoming&) {});
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().text(), HasSubstr("no such group"));
  EXPECT_FALSE(fs::exists(folder / "observe.sock"));
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give to any group";
  options.observe_group = "users";
  options.operate_group = "daemon";
  const TestServer server(options);
  struct stat observe {};
  struct stat operate {};
  ASSERT_EQ(::stat((server.folder() / "observe.sock").c_str(), &observe), 0);
  ASSERT_EQ(::stat((server.folder() / "operate.sock").c_str(), &operate), 0);
  EXPECT_NE(observe.st_gid, operate.st_gid);
  EXPECT_EQ(observe.st_mode & 0777U, 0660U);
  EXPECT_EQ(operate.st_mode & 0777U, 0660U);
}

}  // namespace
}  // namespace rig::protocol
