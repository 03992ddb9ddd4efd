// The client's side: time-outs, late answers, events between answers, and a server that speaks another
// language.
#include "protocol/client.h"

#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/protocol/raw_client.h"

namespace rig::protocol {
namespace {

using base::ErrorCode;
using namespace rig::protocol::testing;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

Request status_request() {
  Request request;
  request.mutable_get_status();
  return request;
}

Client connected(const std::string& endpoint) {
  auto client = Client::connect(endpoint);
  EXPECT_TRUE(client.has_value()) << client.error().text();
  return std::move(*client);
}

TEST(Client, AsksAndIsAnswered) {
  const TestServer server;
  Client client = connected(server.operate());
  for (int i = 0; i < 20; ++i) {
    const auto reply = client.ask(status_request(), kPatience);
    ASSERT_TRUE(reply.has_value()) << reply.error().text();
    EXPECT_EQ(reply->outcome(), DONE);
  }
  const auto taken = server.taken();
  ASSERT_EQ(taken.size(), 20U);
  for (std::size_t i = 0; i < taken.size(); ++i) {
    EXPECT_EQ(taken[i].request.version(), kVersion);
    EXPECT_EQ(taken[i].request.id(), i + 1);
  }
}

TEST(Client, ARefusalIsAnAnswer) {
  const TestServer server;
  Client client = connected(server.operate());
  const auto reply = client.ask(Request(), kPatience);
  ASSERT_TRUE(reply.has_value()) << reply.error().text();
  EXPECT_EQ(reply->outcome(), REFUSED);
  EXPECT_THAT(reply->reason(), HasSubstr("no command"));
}

TEST(Client, NoAnswerIsATimeOutThatSaysWhatToDo) {
  const test::TemporaryFolder folder;
  const std::string endpoint = "ipc://" + (folder / "operate.sock").string();
  Client client = connected(endpoint);
  const auto reply = client.ask(status_request(), milliseconds(30));
  ASSERT_FALSE(reply.has_value());
  EXPECT_EQ(reply.error().code, ErrorCode::timeout);
  EXPECT_EQ(reply.error().where, endpoint);
  EXPECT_THAT(reply.error().hint, HasSubstr("RIG_RUNTIME_DIR"));
  const auto event = client.next_event(milliseconds(1));
  ASSERT_TRUE(event.has_value());
  EXPECT_FALSE(event->has_value());
}

TEST(Client, TheLateAnswerOfARequestGivenUpIsNotThatOfTheNext) {
  // Answers nothing until the second request is there, then both.
  std::optional<Incoming> first;
  const TestServer server({}, [&first](Server& s, const Incoming& in) {
    if (!first) {
      first = in;
      return;
    }
    TestServer::done(s, *first);
    TestServer::done(s, in);
  });
  Client client = connected(server.operate());
  EXPECT_EQ(client.ask(status_request(), milliseconds(30)).error().code, ErrorCode::timeout);
  const auto reply = client.ask(status_request(), kPatience);
  ASSERT_TRUE(reply.has_value()) << reply.error().text();
  EXPECT_EQ(reply->id(), 2U);
}

TEST(Client, KeepsTheEventsThatComeBeforeAnAnswer) {
  const TestServer server({}, [](Server& s, const Incoming& in) {
    s.subscribe(in.client, std::nullopt);
    for (std::uint64_t i = 0; i < 3; ++i) s.publish(event_of(10 * in.request.id() + i));
    TestServer::done(s, in);
  });
  Client client = connected(server.operate());
  for (std::uint64_t id = 1; id <= 2; ++id) {
    const auto reply = client.ask(status_request(), kPatience);
    ASSERT_TRUE(reply.has_value()) << reply.error().text();
    EXPECT_EQ(reply->id(), id);
  }
  for (const std::uint64_t number : {10, 11, 12, 20, 21, 22}) {
    const auto event = client.next_event(kPatience);
    ASSERT_TRUE(event.has_value() && event->has_value());
    EXPECT_EQ((*event)->number(), number);
  }
  EXPECT_FALSE(client.next_event(milliseconds(0)).value().has_value());
}

TEST(Client, MovesWithItsEvents) {
  const TestServer server;
  Client client = connected(server.operate());
  ASSERT_TRUE(client.ask(status_request(), kPatience).has_value());
  Client other = std::move(client);
  const auto reply = other.ask(status_request(), kPatience);
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->id(), 2U);
}

TEST(Client, RefusesAnEndpointThatIsNone) {
  for (const char* endpoint : {"", "rigd", "nonsense://here"}) {
    const auto client = Client::connect(endpoint);
    ASSERT_FALSE(client.has_value()) << endpoint;
    EXPECT_EQ(client.error().code, ErrorCode::bad_input);
  }
}

// Something that is not rigd, or one of a later time, answers.
class ForeignServer : public ::testing::Test {
 protected:
  // Answers the first request of a client with these frames; what the client makes of it.
  base::Result<Reply> answered_with(const std::vector<std::string_view>& frames) const {
    const Socket router(context_, ZMQ_ROUTER);
    const std::string endpoint = "ipc://" + (folder_ / "sock").string();
    EXPECT_EQ(zmq_bind(router.get(), endpoint.c_str()), 0);
    Client client = connected(endpoint);
    std::thread answering([&] {
      zmq_pollitem_t item{router.get(), 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&item, 1, std::chrono::milliseconds(kPatience).count()) != 1) return;
      const auto request = receive(router);
      if (!request) return;
      std::vector<std::string_view> out{request->front()};
      out.insert(out.end(), frames.begin(), frames.end());
      (void)send(router, out);
    });
    auto reply = client.ask(status_request(), kPatience);
    answering.join();
    return reply;
  }

  static std::string answer(std::uint32_t version) {
    Message message;
    message.set_version(version);
    message.mutable_reply()->set_id(1);
    message.mutable_reply()->set_outcome(DONE);
    auto* reply = message.mutable_reply();
    reply->GetReflection()->MutableUnknownFields(reply)->AddLengthDelimited(70, "of a later time");
    return message.SerializeAsString();
  }

  const test::TemporaryFolder folder_;
  const Context context_;
};

TEST_F(ForeignServer, OfALaterTimeIsUnderstoodWhereTheVersionIsTheSame) {
  const std::string bytes = answer(kVersion);
  const auto reply = answered_with({kMagic, bytes});
  ASSERT_TRUE(reply.has_value()) << reply.error().text();
  EXPECT_EQ(reply->outcome(), DONE);
}

TEST_F(ForeignServer, OfANewerVersionIsSaidToBeNewer) {
  const std::string bytes = answer(kVersion + 1);
  const auto reply = answered_with({kMagic, bytes});
  ASSERT_FALSE(reply.has_value());
  EXPECT_EQ(reply.error().code, ErrorCode::newer);
}

TEST_F(ForeignServer, ThatTalksRubbishIsAnError) {
  const auto reply = answered_with({"HTTP", "400 Bad Request"});
  ASSERT_FALSE(reply.has_value());
  EXPECT_EQ(reply.error().code, ErrorCode::bad_input);
}

TEST(DefaultEndpoint, ComesFromTheEnvironment) {
  const auto with = [](const char* endpoint, const char* folder) {
    endpoint != nullptr ? ::setenv("RIG_ENDPOINT", endpoint, 1) : ::unsetenv("RIG_ENDPOINT");
    folder != nullptr ? ::setenv("RIG_RUNTIME_DIR", folder, 1) : ::unsetenv("RIG_RUNTIME_DIR");
    const std::string found = default_endpoint();
    ::unsetenv("RIG_ENDPOINT");
    ::unsetenv("RIG_RUNTIME_DIR");
    return found;
  };
  EXPECT_EQ(with(nullptr, nullptr), "ipc:///run/rigd/operate.sock");
  EXPECT_EQ(with(nullptr, "/here"), "ipc:///here/operate.sock");
  EXPECT_EQ(with("ipc:///there/observe.sock", "/here"), "ipc:///there/observe.sock");
}

}  // namespace
}  // namespace rig::protocol
