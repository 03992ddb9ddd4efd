// A client that may send anything, and a server whose requests and answers a test decides about.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <gtest/gtest.h>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "protocol/envelope.h"
#include "protocol/server.h"
#include "protocol/sockets.h"
#include "tests/core/temporary_folder.h"

namespace rig::protocol::testing {

/// Only how long a failing test takes depends on it.
inline constexpr std::chrono::seconds kPatience{20};

class RawClient {
 public:
  /// `queue`: how many messages ZeroMQ takes in for it ahead of its reading. `prepare` sets what must be set
  /// before it connects.
  explicit RawClient(const std::string& endpoint, int queue = 1000,
                     const std::function<void(const Context&, const Socket&)>& prepare = {})
      : socket_(context_, ZMQ_DEALER) {
    socket_.set(ZMQ_RCVHWM, queue);
    if (prepare) prepare(context_, socket_);
    EXPECT_EQ(zmq_connect(socket_.get(), endpoint.c_str()), 0) << zmq_strerror(zmq_errno());
  }

  void send(const std::vector<std::string_view>& frames) const {
    EXPECT_TRUE(protocol::send(socket_, frames)) << zmq_strerror(zmq_errno());
  }
  void send(Request request, std::uint64_t id) const {
    request.set_version(kVersion);
    request.set_id(id);
    const std::string bytes = request.SerializeAsString();
    send({kMagic, bytes});
  }
  /// A request that asks for nothing.
  void ping(std::uint64_t id) const {
    Request request;
    request.mutable_get_status();
    send(std::move(request), id);
  }

  /// The next message; an empty one (and a failure) where none came.
  [[nodiscard]] Message next() const {
    auto message = next_within(kPatience);
    EXPECT_TRUE(message.has_value()) << "nothing came";
    return message.value_or(Message());
  }
  [[nodiscard]] std::optional<Message> next_within(std::chrono::milliseconds time) const {
    zmq_pollitem_t item{socket_.get(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&item, 1, static_cast<long>(time.count())) <= 0) return std::nullopt;
    const auto frames = receive(socket_);
    if (!frames) return std::nullopt;
    auto message = read_message({frames->begin(), frames->end()});
    EXPECT_TRUE(message.has_value()) << message.error().text();
    if (!message) return std::nullopt;
    return std::move(*message);
  }

  [[nodiscard]] const Context& context() const { return context_; }
  [[nodiscard]] const Socket& socket() const { return socket_; }

 private:
  Context context_;
  Socket socket_;
};

/// A server in a folder of its own that answers every request with DONE, unless a test has other wishes.
class TestServer {
 public:
  using Answer = std::function<void(Server&, const Incoming&)>;

  explicit TestServer(ServerOptions options = {}, Answer answer = {}) : answer_(std::move(answer)) {
    options.folder = folder_.path();
    const std::lock_guard until_started(mutex_);
    auto server = Server::start(options, [this](Incoming in) { take(std::move(in)); });
    EXPECT_TRUE(server.has_value()) << server.error().text();
    if (server) server_ = std::move(*server);
    running_ = server_.get();
  }
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;
  ~TestServer() { stop(); }

  void stop() { server_.reset(); }
  [[nodiscard]] Server& server() const { return *server_; }
  [[nodiscard]] std::filesystem::path folder() const { return folder_.path(); }
  [[nodiscard]] std::string operate() const { return "ipc://" + (folder_ / "operate.sock").string(); }
  [[nodiscard]] std::string observe() const { return "ipc://" + (folder_ / "observe.sock").string(); }

  [[nodiscard]] std::vector<Incoming> taken() const {
    const std::lock_guard lock(mutex_);
    return taken_;
  }
  /// The client of the first request of that number, once it has come.
  [[nodiscard]] ClientId client_of(std::uint64_t id) const {
    std::unique_lock lock(mutex_);
    ClientId found;
    EXPECT_TRUE(changed_.wait_for(lock, kPatience,
                                  [&] {
                                    for (const Incoming& in : taken_) {
                                      if (in.request.id() != id) continue;
                                      found = in.client;
                                      return true;
                                    }
                                    return false;
                                  }))
        << "no request " << id;
    return found;
  }
  /// Lets the client be known here, with the exchange of one request.
  [[nodiscard]] ClientId greet(const RawClient& client, std::uint64_t id) const {
    client.ping(id);
    EXPECT_EQ(client.next().reply().id(), id);
    return client_of(id);
  }

  static void done(Server& server, const Incoming& in) {
    Reply reply;
    reply.set_id(in.request.id());
    reply.set_outcome(DONE);
    server.reply(in.client, reply);
  }

 private:
  void take(Incoming in) {
    {
      const std::lock_guard lock(mutex_);
      taken_.push_back(in);
      changed_.notify_all();
    }
    if (answer_)
      answer_(*running_, in);
    else
      done(*running_, in);
  }

  const test::TemporaryFolder folder_;
  const Answer answer_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<Incoming> taken_;
  Server* running_ = nullptr;  // for its own thread, while stop() takes the other away
  std::unique_ptr<Server> server_;
};

inline Event event_of(std::uint64_t number, std::size_t bytes = 0) {
  Event event;
  event.set_epoch(1);
  event.set_number(number);
  event.mutable_alarm()->set_text(std::string(bytes, 'x'));
  return event;
}

inline Event preview_of(std::int64_t row, std::size_t bytes = 0) {
  Event event;
  event.mutable_preview()->set_row(row);
  event.mutable_preview()->mutable_frame()->set_preview_rgb(std::string(bytes, 'x'));
  return event;
}

}  // namespace rig::protocol::testing
