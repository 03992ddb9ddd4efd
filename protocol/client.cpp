#include "protocol/client.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <deque>

#include "core/base/interrupt.h"
#include "protocol/envelope.h"
#include "protocol/handshake_watch.h"
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

namespace {

// A connection on which nothing moves is probed, and ended where no answer comes.
// The signal may have come to another thread, or just before the wait.
constexpr long kInterruptSeen_ms = 200;
constexpr int kHeartbeatEvery_ms = 5000;
constexpr int kHeartbeatPatience_ms = 15000;

bool is_network(const std::string& endpoint) {
  return endpoint.starts_with("tcp://");
}

}  // namespace

Result<ClientKeys> keys_from_environment() {
  const char* own = std::getenv("RIG_KEY");
  const char* server = std::getenv("RIG_SERVER_KEY");
  if (own == nullptr || server == nullptr) {
    return fail(ErrorCode::bad_input, "a connection over the network needs keys", {},
                "RIG_KEY: the file of your keys; RIG_SERVER_KEY: rigd's public key or its .pub file");
  }
  auto keys = read_key_file(own);
  if (!keys) return pass(keys);
  auto public_key = read_public_key(server);
  if (!public_key) return pass(public_key);
  return ClientKeys{std::move(*keys), std::move(*public_key)};
}

struct Client::State {
  std::string endpoint;
  Context context;
  Socket socket{context, ZMQ_DEALER};
  std::optional<HandshakeWatch> watch;  // of a connection over the network
  std::uint64_t next_id = 1;
  std::deque<Event> events;

  // The next message, waiting until `deadline`; nothing once that has passed.
  Result<std::optional<Message>> next(Steady::time_point deadline) {
    // What is asked after an interrupt, to end in order, is waited for.
    const bool already = base::interrupted();
    while (true) {
      if (auto frames = receive(socket)) {
        auto message = read_message({frames->begin(), frames->end()});
        if (!message) return pass(message);
        return std::optional<Message>(std::move(*message));
      }
      if (watch) {
        watch->read();
        if (watch->turned_away()) {
          return fail(ErrorCode::refused, "rigd does not allow this key", endpoint,
                      "`rig keys allow` on rigd's machine lets it in");
        }
      }
      const auto left = std::chrono::ceil<milliseconds>(deadline - Steady::now()).count();
      if (left <= 0) return std::optional<Message>();
      std::array<zmq_pollitem_t, 2> items{
          {{socket.get(), 0, ZMQ_POLLIN, 0}, {watch ? watch->handle() : nullptr, -1, ZMQ_POLLIN, 0}}};
      const long slice = std::min(static_cast<long>(left), kInterruptSeen_ms);
      const bool woken = zmq_poll(items.data(), watch ? 2 : 1, slice) < 0 && zmq_errno() == EINTR;
      if (woken || (base::interrupted() && !already)) return fail(ErrorCode::interrupted, "interrupted");
    }
  }
};

Client::Client(std::unique_ptr<State> state) : state_(std::move(state)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(const std::string& endpoint, const ClientKeys& keys) {
  auto state = std::make_unique<State>();
  state->endpoint = endpoint;
  const Socket& socket = state->socket;
  if (!socket.require(ZMQ_CURVE_SERVERKEY, keys.server) ||
      !socket.require(ZMQ_CURVE_PUBLICKEY, keys.own.public_key) ||
      !socket.require(ZMQ_CURVE_SECRETKEY, keys.own.secret_key)) {
    return fail(ErrorCode::bad_input, "these are no keys", endpoint);
  }
  socket.set(ZMQ_IPV6, 1);
  socket.set(ZMQ_HEARTBEAT_IVL, kHeartbeatEvery_ms);
  socket.set(ZMQ_HEARTBEAT_TIMEOUT, kHeartbeatPatience_ms);
  auto watch = HandshakeWatch::start(state->context, socket);
  if (!watch) return pass(watch);
  state->watch.emplace(std::move(*watch));
  if (zmq_connect(socket.get(), endpoint.c_str()) != 0) {
    return fail(ErrorCode::bad_input, fmt::format("cannot connect: {}", zmq_strerror(zmq_errno())), endpoint);
  }
  return Client(std::move(state));
}

Result<Client> Client::connect(const std::string& endpoint) {
  if (is_network(endpoint)) {
    const auto keys = keys_from_environment();
    if (!keys) return pass(keys);
    return connect(endpoint, *keys);
  }
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
    const char* hint = "is rigd running? RIG_RUNTIME_DIR names the folder of its sockets";
    if (state_->watch) {
      hint = state_->watch->broken_off()
                 ? "it broke the handshake off: is RIG_SERVER_KEY the key of this rigd?"
                 : "is rigd running there, and can this machine reach it?";
    }
    return fail(ErrorCode::timeout,
                fmt::format("no answer from rigd within {} s", static_cast<double>(timeout.count()) * 1e-3),
                state_->endpoint, hint);
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
    if (state_->watch && state_->watch->take_lost()) {
      return fail(ErrorCode::timeout, "the connection to rigd broke", state_->endpoint, "subscribe again");
    }
    if (!*message) return std::optional<Event>();
    if ((*message)->has_event()) state_->events.push_back(std::move(*(*message)->mutable_event()));
  }
  std::optional<Event> event(std::move(state_->events.front()));
  state_->events.pop_front();
  return event;
}

}  // namespace rig::protocol
