#include "protocol/server.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

#include "protocol/envelope.h"
#include "protocol/outbox.h"
#include "protocol/socket_folder.h"
#include "protocol/sockets.h"

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

struct Endpoint {
  const char* file;
  Role role;
};
constexpr std::array<Endpoint, 2> kEndpoints{
    {{"observe.sock", Role::observer}, {"operate.sock", Role::operator_}}};

// What other threads hand to the socket thread.
struct Outgoing {
  enum class Kind { message, subscribe, unsubscribe, event, preview } kind = Kind::message;
  ClientId client;
  bool previews = false;
  std::string bytes;
};

struct Subscriber {
  bool previews = false;
  std::uint64_t previews_dropped = 0;
};

std::string serialised(const Reply& reply) {
  Message message;
  message.set_version(kVersion);
  *message.mutable_reply() = reply;
  return message.SerializeAsString();
}

std::string serialised(const Event& event) {
  Message message;
  message.set_version(kVersion);
  *message.mutable_event() = event;
  return message.SerializeAsString();
}

// ZeroMQ keeps this many messages for a client itself; what is beyond waits in the outbox, where it is
// bounded and counted.
constexpr int kShortQueue = 16;
// How soon a client that did not read is tried again.
constexpr long kTryAgain_ms = 20;
// At the end: how long clients have to take what waits, and ZeroMQ to hand over what was sent.
constexpr int kLinger_ms = 1000;

}  // namespace

struct Server::State {
  ServerOptions options;
  Handler handler;
  SocketFolder folder;
  Context context;
  std::vector<Socket> sockets;
  Outbox outbox;
  int wake_fd = -1;
  std::mutex mutex;
  std::deque<Outgoing> queue;
  std::atomic<bool> ending{false};
  std::atomic<std::size_t> subscribers_now{0};
  std::atomic<std::uint64_t> previews_dropped{0};
  std::map<ClientId, Subscriber> subscribers;  // of the socket thread alone
  std::thread thread;

  State(const ServerOptions& o, Handler h, SocketFolder f)
      : options(o),
        handler(std::move(h)),
        folder(std::move(f)),
        outbox(Outbox::Limits{o.queue_per_client},
               [this](const ClientId& client, std::string_view bytes) { return try_send(client, bytes); }) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    ending = true;
    wake();
    if (thread.joinable()) thread.join();
    if (wake_fd >= 0) ::close(wake_fd);
    // Those that were bound here: where the start failed the others may belong to another rigd.
    for (std::size_t i = 0; i < sockets.size(); ++i) {
      std::error_code already_gone;
      fs::remove(options.folder / kEndpoints.at(i).file, already_gone);
    }
  }

  void wake() const {
    const std::uint64_t one = 1;
    // A full counter wakes as well; nothing is lost.
    (void)!::write(wake_fd, &one, sizeof one);
  }

  void hand_in(Outgoing out) {
    {
      const std::lock_guard lock(mutex);
      queue.push_back(std::move(out));
    }
    wake();
  }

  Sent try_send(const ClientId& client, std::string_view bytes) {
    if (send(sockets[client.socket], {client.routing, kMagic, bytes})) return Sent::yes;
    return errno == EHOSTUNREACH ? Sent::gone : Sent::full;
  }

  void forget(const ClientId& client) {
    subscribers.erase(client);
    subscribers_now = subscribers.size();
  }

  void carry_out(const Outgoing& out) {
    switch (out.kind) {
      case Outgoing::Kind::message:
        if (outbox.answer(out.client, out.bytes) == Sent::gone) forget(out.client);
        return;
      case Outgoing::Kind::subscribe:
        subscribers[out.client].previews = out.previews;
        subscribers_now = subscribers.size();
        return;
      case Outgoing::Kind::unsubscribe:
        forget(out.client);
        return;
      case Outgoing::Kind::event: {
        std::vector<ClientId> clients;
        clients.reserve(subscribers.size());
        for (const auto& [client, subscriber] : subscribers) clients.push_back(client);
        for (const ClientId& client : clients) {
          if (outbox.event(client, out.bytes) == Sent::gone) forget(client);
        }
        return;
      }
      case Outgoing::Kind::preview:
        carry_out_preview(out);
        return;
    }
  }

  void carry_out_preview(const Outgoing& out) {
    Event event;
    event.ParseFromString(out.bytes);
    std::vector<ClientId> gone;
    for (auto& [client, subscriber] : subscribers) {
      if (!subscriber.previews) continue;
      event.mutable_preview()->set_dropped_before(subscriber.previews_dropped);
      switch (outbox.preview(client, serialised(event))) {
        case Sent::yes:
          subscriber.previews_dropped = 0;
          break;
        case Sent::full:
          ++subscriber.previews_dropped;
          ++previews_dropped;
          break;
        case Sent::gone:
          gone.push_back(client);
          break;
      }
    }
    for (const ClientId& client : gone) forget(client);
  }

  void receive_all(std::size_t socket) {
    while (auto frames = receive(sockets[socket])) {
      if (frames->empty()) continue;
      const ClientId client{socket, (*frames)[0]};
      const std::vector<std::string_view> rest(frames->begin() + 1, frames->end());
      std::uint64_t id = 0;
      auto request = read_request(rest, id);
      if (request) {
        handler({client, kEndpoints[socket].role, std::move(*request)});
        continue;
      }
      Reply reply;
      reply.set_id(id);
      reply.set_outcome(REFUSED);
      reply.set_reason(request.error().text());
      if (outbox.answer(client, serialised(reply)) == Sent::gone) forget(client);
    }
  }

  void run() {
    while (!ending) {
      std::array<zmq_pollitem_t, 3> items{{{sockets[0].get(), 0, ZMQ_POLLIN, 0},
                                           {sockets[1].get(), 0, ZMQ_POLLIN, 0},
                                           {nullptr, wake_fd, ZMQ_POLLIN, 0}}};
      zmq_poll(items.data(), static_cast<int>(items.size()), outbox.waiting() ? kTryAgain_ms : -1);
      std::uint64_t count = 0;
      (void)!::read(wake_fd, &count, sizeof count);
      std::deque<Outgoing> out;
      {
        const std::lock_guard lock(mutex);
        out.swap(queue);
      }
      outbox.flush([this](const ClientId& client) { forget(client); });
      for (const Outgoing& o : out) carry_out(o);
      for (std::size_t i = 0; i < sockets.size(); ++i) receive_all(i);
    }
    // What was handed in before the end still goes out, to those who read it.
    const std::lock_guard lock(mutex);
    for (const Outgoing& o : queue) carry_out(o);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(kLinger_ms);
    while (outbox.waiting() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      outbox.flush([this](const ClientId& client) { forget(client); });
    }
  }
};

Server::Server(std::unique_ptr<State> state) : state_(std::move(state)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const ServerOptions& options, Handler handler) {
  auto folder = SocketFolder::take(options.folder);
  if (!folder) return base::pass(folder);
  auto state = std::make_unique<State>(options, std::move(handler), std::move(*folder));
  state->wake_fd = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  for (const Endpoint& e : kEndpoints) {
    const auto path = state->folder.make_way(e.file);
    if (!path) return base::pass(path);
    Socket socket(state->context, ZMQ_ROUTER);
    socket.set(ZMQ_ROUTER_MANDATORY, 1);
    socket.set(ZMQ_SNDHWM, kShortQueue);
    socket.set(ZMQ_LINGER, kLinger_ms);
    socket.set_wide(ZMQ_MAXMSGSIZE, static_cast<long long>(options.max_message_bytes));
    // Only the owner and the group may connect, from the first moment on.
    const mode_t before = ::umask(0117);
    const int bound = zmq_bind(socket.get(), ("ipc://" + path->string()).c_str());
    ::umask(before);
    if (bound != 0)
      return fail(ErrorCode::io, fmt::format("cannot listen: {}", zmq_strerror(zmq_errno())), path->string());
    state->sockets.push_back(std::move(socket));
  }
  State* running = state.get();
  state->thread = std::thread([running] { running->run(); });
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

void Server::reply(const ClientId& client, const Reply& reply) {
  state_->hand_in({Outgoing::Kind::message, client, false, serialised(reply)});
}
void Server::subscribe(const ClientId& client, bool previews) {
  state_->hand_in({Outgoing::Kind::subscribe, client, previews, {}});
}
void Server::unsubscribe(const ClientId& client) {
  state_->hand_in({Outgoing::Kind::unsubscribe, client, false, {}});
}
void Server::publish(const Event& event) {
  state_->hand_in({Outgoing::Kind::event, {}, false, serialised(event)});
}
void Server::publish_preview(const Event& event) {
  state_->hand_in({Outgoing::Kind::preview, {}, false, event.SerializeAsString()});
}
std::size_t Server::client_count() const {
  return state_->subscribers_now;
}
std::uint64_t Server::previews_dropped() const {
  return state_->previews_dropped;
}

}  // namespace rig::protocol
