// The server: every request answered once, whatever comes in; who connects where; its socket files.
#include "protocol/server.h"

#include <csignal>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "tests/core/seed.h"
#include "tests/protocol/raw_client.h"

namespace rig::protocol {
namespace {

namespace fs = std::filesystem;
using base::ErrorCode;
using namespace rig::protocol::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// ---- Answers

TEST(Server, AnswersEachOfManyOverlappingRequestsOnce) {
  const TestServer server;
  constexpr std::uint64_t kRequests = 300;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (const std::string& endpoint : {server.operate(), server.observe(), server.operate()}) {
    clients.push_back(std::make_unique<RawClient>(endpoint));
  }
  for (std::uint64_t id = 1; id <= kRequests; ++id) {
    for (const auto& client : clients) client->ping(id);
  }
  for (const auto& client : clients) {
    for (std::uint64_t id = 1; id <= kRequests; ++id) {
      const Message message = client->next();
      ASSERT_TRUE(message.has_reply());
      EXPECT_EQ(message.version(), kVersion);
      EXPECT_EQ(message.reply().outcome(), DONE);
      ASSERT_EQ(message.reply().id(), id);
    }
    // The answer to one more is the next that comes: there was no second to any.
    client->ping(9999);
    EXPECT_EQ(client->next().reply().id(), 9999U);
  }
  EXPECT_EQ(server.taken().size(), 3 * (kRequests + 1));
}

TEST(Server, HandsEachRequestOverAsItIs) {
  const TestServer server;
  const RawClient client(server.operate());
  Request request;
  request.mutable_submit_job()->set_job_toml(std::string("any \0 bytes", 11));
  client.send(request, 5);
  EXPECT_EQ(client.next().reply().id(), 5U);
  const auto taken = server.taken();
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].request.submit_job().job_toml(), request.submit_job().job_toml());
}

TEST(Server, TellsObserversFromOperatorsAndClientsFromEachOther) {
  const TestServer server;
  const RawClient observer(server.observe());
  const RawClient operator_one(server.operate());
  const RawClient operator_two(server.operate());
  const ClientId one = server.greet(observer, 1);
  const ClientId two = server.greet(operator_one, 2);
  const ClientId three = server.greet(operator_two, 3);
  EXPECT_FALSE(one == two);
  EXPECT_FALSE(two == three);
  EXPECT_EQ(server.greet(operator_one, 4), two) << "the same connection, another client";
  std::map<std::uint64_t, Role> roles;
  for (const Incoming& in : server.taken()) roles[in.request.id()] = in.role;
  EXPECT_EQ(roles, (std::map<std::uint64_t, Role>{
                       {1, Role::observer}, {2, Role::admin}, {3, Role::admin}, {4, Role::admin}}))
      << "who runs the server may do everything where commands are taken";
}

// Who connects chooses its routing id; on the other socket it is nobody.
TEST(Server, ANameOnOneSocketIsNotThatOfTheOther) {
  const TestServer server;
  const Context context;
  std::vector<Socket> sockets;
  for (const std::string& endpoint : {server.observe(), server.operate()}) {
    sockets.emplace_back(context, ZMQ_DEALER);
    zmq_setsockopt(sockets.back().get(), ZMQ_ROUTING_ID, "same", 4);
    ASSERT_EQ(zmq_connect(sockets.back().get(), endpoint.c_str()), 0);
  }
  std::uint64_t id = 0;
  for (const Socket& socket : sockets) {
    Request request;
    request.set_version(kVersion);
    request.set_id(++id);
    request.mutable_get_status();
    ASSERT_TRUE(send(socket, {kMagic, request.SerializeAsString()}));
  }
  const ClientId observer = server.client_of(1);
  const ClientId operator_ = server.client_of(2);
  EXPECT_EQ(observer.routing, operator_.routing);
  EXPECT_FALSE(observer == operator_);
}

TEST(Server, AnAnswerToNobodyIsNoHarm) {
  const TestServer server;
  Reply reply;
  reply.set_id(1);
  server.server().reply({0, "nobody"}, reply);
  server.server().reply({1, ""}, reply);
  const RawClient client(server.operate());
  (void)server.greet(client, 2);
}

// ---- What is no request

TEST(Server, AnswersWhatIsNoRequestWithTheReason) {
  const TestServer server;
  const RawClient client(server.operate());
  Request request;
  request.set_version(kVersion);
  request.set_id(42);
  const std::string no_command = request.SerializeAsString();
  request.mutable_get_status();
  const std::string good = request.SerializeAsString();
  request.set_version(kVersion + 1);
  const std::string newer = request.SerializeAsString();

  const std::string cut = good.substr(0, 3);

  struct Case {
    std::vector<std::string_view> frames;
    std::uint64_t id;
    const char* said;
  };
  const std::vector<Case> cases{
      {{"RIG1", newer}, 42, "newer"},      {{"RIG1", no_command}, 42, "no command"},
      {{"RIG2", good}, 0, "RIG1"},         {{"RIG1", "\xFF\xFF\xFF"}, 0, "no Request"},
      {{"RIG1", cut}, 0, "no Request"},    {{"RIG1", ""}, 0, "version"},
      {{"RIG1"}, 0, "2 frames"},           {{""}, 0, "2 frames"},
      {{"", "RIG1", good}, 0, "2 frames"}, {{"RIG1", good, good, good}, 0, "2 frames"}};
  for (const Case& c : cases) {
    client.send(c.frames);
    const Message message = client.next();
    EXPECT_EQ(message.reply().outcome(), REFUSED) << c.said;
    EXPECT_EQ(message.reply().id(), c.id) << c.said;
    EXPECT_THAT(message.reply().reason(), HasSubstr(c.said));
  }
  EXPECT_THAT(server.taken(), IsEmpty());
  (void)server.greet(client, 7);
}

TEST(Server, AnswersEachPieceOfRubbishOnce) {
  const TestServer server;
  const RawClient client(server.observe());
  std::mt19937_64 random(test::seed(51));
  constexpr std::uint64_t kPieces = 2000;
  for (std::uint64_t i = 0; i < kPieces; ++i) {
    std::vector<std::string> frames(1 + random() % 3);
    for (auto& frame : frames) {
      frame.resize(random() % 60);
      for (char& c : frame) c = static_cast<char>(random());
    }
    if (random() % 2 == 0) frames[0] = kMagic;
    client.send({frames.begin(), frames.end()});
    ASSERT_TRUE(client.next().has_reply());
  }
  client.ping(7);
  EXPECT_EQ(client.next().reply().id(), 7U);
}

TEST(Server, SurvivesWhoDoesNotSpeakZeroMq) {
  const TestServer server;
  const RawClient client(server.operate());
  (void)server.greet(client, 1);
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\n\r\n"), std::string(100'000, '\xFF'), std::string()}) {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = (server.folder() / "operate.sock").string();
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    ASSERT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    // It may hang up in the middle of that.
    (void)::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    ::close(fd);
  }
  (void)server.greet(client, 2);
  EXPECT_EQ(server.taken().size(), 2U);
}

TEST(Server, EndsTheConnectionOfAnOversizeRequestAlone) {
  ServerOptions options;
  options.max_message_bytes = 10'000;
  const TestServer server(options);
  const RawClient good(server.operate());
  const RawClient bad(server.operate());
  (void)server.greet(good, 1);
  (void)server.greet(bad, 2);

  ASSERT_EQ(zmq_socket_monitor(bad.socket().get(), "inproc://monitor", ZMQ_EVENT_DISCONNECTED), 0);
  const Socket monitor(bad.context(), ZMQ_PAIR);
  ASSERT_EQ(zmq_connect(monitor.get(), "inproc://monitor"), 0);
  Request request;
  request.mutable_submit_job()->set_job_toml(std::string(20'000, 'x'));
  bad.send(request, 3);
  zmq_pollitem_t item{monitor.get(), 0, ZMQ_POLLIN, 0};
  const long patience_ms = std::chrono::milliseconds(kPatience).count();
  EXPECT_EQ(zmq_poll(&item, 1, patience_ms), 1) << "still connected";
  zmq_socket_monitor(bad.socket().get(), nullptr, 0);

  request.mutable_submit_job()->set_job_toml(std::string(9'000, 'x'));
  good.send(request, 4);
  EXPECT_EQ(good.next().reply().id(), 4U);
  const RawClient another(server.operate());
  (void)server.greet(another, 5);
  for (const Incoming& in : server.taken()) EXPECT_NE(in.request.id(), 3U);
}

// ---- Socket files

TEST(ServerSockets, LetOwnerAndGroupInWhateverTheMask) {
  for (const mode_t mask : {mode_t{0}, mode_t{022}, mode_t{077}}) {
    const mode_t before = ::umask(mask);
    const TestServer server;
    EXPECT_EQ(::umask(before), mask) << "the mask was not given back";
    for (const char* name : {"observe.sock", "operate.sock"}) {
      struct stat info {};
      ASSERT_EQ(::stat((server.folder() / name).c_str(), &info), 0);
      EXPECT_TRUE(S_ISSOCK(info.st_mode));
      EXPECT_EQ(info.st_mode & 0777U, 0660U) << name;
    }
  }
}

TEST(ServerSockets, AreGoneWithTheServer) {
  TestServer server;
  server.stop();
  EXPECT_FALSE(fs::exists(server.folder() / "observe.sock"));
  EXPECT_FALSE(fs::exists(server.folder() / "operate.sock"));
}

TEST(ServerSockets, OfOneFolderBelongToOneServer) {
  const TestServer server;
  const RawClient client(server.operate());
  (void)server.greet(client, 1);
  ServerOptions options;
  options.folder = server.folder();
  for (int i = 0; i < 2; ++i) {
    const auto second = Server::start(options, [](const Incoming&) {});
    ASSERT_FALSE(second.has_value());
    EXPECT_EQ(second.error().code, ErrorCode::busy);
    EXPECT_THAT(second.error().text(), HasSubstr("another rigd listens"));
  }
  // The first is none the worse, for old clients and for new ones.
  (void)server.greet(client, 2);
  const RawClient another(server.observe());
  (void)server.greet(another, 3);
}

TEST(ServerSockets, ThatAKilledServerLeftAreReplaced) {
  const test::TemporaryFolder folder;
  ServerOptions options;
  options.folder = folder.path();
  const int status = test::in_child([&] {
    const auto server = Server::start(options, [](const Incoming&) {});
    return server ? ::raise(SIGKILL) : 1;
  });
  ASSERT_EQ(status, -1);
  ASSERT_TRUE(fs::is_socket(folder / "operate.sock"));
  const auto server = Server::start(options, [&](const Incoming&) {});
  EXPECT_TRUE(server.has_value()) << server.error().text();
}

TEST(ServerSockets, DoNotReplaceWhatIsNoSocket) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "operate.sock", "mine");
  ServerOptions options;
  options.folder = folder.path();
  const auto server = Server::start(options, [](const Incoming&) {});
  ASSERT_FALSE(server.has_value());
  EXPECT_EQ(server.error().code, ErrorCode::refused);
  EXPECT_EQ(test::bytes_in(folder / "operate.sock"), "mine");
  EXPECT_FALSE(fs::exists(folder / "observe.sock")) << "half a server is left";
}

}  // namespace
}  // namespace rig::protocol
