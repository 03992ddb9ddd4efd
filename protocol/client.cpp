#include "protocol/client.h"

#include <cstdlib>
#include <deque>

#include "protocol/envelope.h"
#include "protocol/sockets.h"

namespace rig::protocol {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

std::string default_endpoint() {
  if (const char* endpoint = std::getenv("RIG_ENDPOINT")) return endpoint;
  const char* folder = std::getenv("RIG_RUNTIME_DIR");
  return fmt::format("ipc://{}/operate.sock", folder != nullptr ? folder : "/run/rigd");
}

struct Client::State {
  std::string endpoint;
  Context context;
  Socket socket{context, ZMQ_DEALER};
  std::uint64_t next_id = 1;
  std::deque<Event> events;

  // The next message, waiting until `deadline`; nothing once that has passed.
  Result<std::optional<Message>> next(Steady::time_point deadline) {
    while (true) {
      if (auto frames = receive(socket)) {
        auto message = read_message({frames->begin(), frames->end()});
        if (!message) return pass(message);
        return std::optional<Message>(std::move(*message));
      }
      const auto left = std::chrono::ceil<milliseconds>(deadline - Steady::now()).count();
      if (left <= 0) return std::optional<Message>();
      zmq_pollitem_t item{socket.get(), 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&item, 1, static_cast<long>(left)) < 0 && zmq_errno() == EINTR) {
        return fail(ErrorCode::interrupted, "interrupted");
      }
    }
  }
};

Client::Client(std::unique_ptr<State> state) : state_(std::move(state)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(const std::string& endpoint) {
  auto state = std::make_unique<State>();
  state->endpoint = endpoint;
  if (zmq_connect(state->socket.get(), endpoint.c_str()) != 0) {
    return fail(ErrorCode::bad_input, fmt::format("cannot connect: {}", zmq_strerror(zmq_errno())), endpoint);
  }
  return Client(std::move(state));
}

Result<Reply> Client::ask(Request request, milliseconds timeout) {
  const std::uint64_t id = state_->next_id++;
  request.set_version(kVersion);
  request.set_id(id);
  const std::string bytes = request.SerializeAsString();
  const auto deadline = Steady::now() + timeout;
  const auto no_answer = [&] {
    return fail(ErrorCode::timeout,
                fmt::format("no answer from rigd within {} s", static_cast<double>(timeout.count()) * 1e-3),
                state_->endpoint, "is rigd running? RIG_RUNTIME_DIR names the folder of its sockets");
  };
  if (!send(state_->socket, {kMagic, bytes})) return no_answer();
  while (true) {
    auto message = state_->next(deadline);
    if (!message) return pass(message);
    if (!*message) return no_answer();
    if ((*message)->has_event()) {
      state_->events.push_back(std::move(*(*message)->mutable_event()));
    } else if ((*message)->has_reply() && (*message)->reply().id() == id) {
      return std::move(*(*message)->mutable_reply());
    }
    // The late answer of a request that was given up is dropped.
  }
}

Result<std::optional<Event>> Client::next_event(milliseconds timeout) {
  const auto deadline = Steady::now() + timeout;
  while (state_->events.empty()) {
    auto message = state_->next(deadline);
    if (!message) return pass(message);
    if (!*message) return std::optional<Event>();
    if ((*message)->has_event()) state_->events.push_back(std::move(*(*message)->mutable_event()));
  }
  std::optional<Event> event(std::move(state_->events.front()));
  state_->events.pop_front();
  return event;
}

}  // namespace rig::protocol
