#include "protocol/server.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <sys/eventfd.h>
#include <thread>
#include <unistd.h>

#include "core/base/log.h"
#include "core/base/thread.h"
#include "protocol/doors.h"
#include "protocol/envelope.h"
#include "protocol/gate.h"
#include "protocol/local_peer.h"
#include "protocol/outbox.h"

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

// What other threads hand to the socket thread.
struct Outgoing {
  enum class Kind { message, subscribe, unsubscribe, event, preview } kind = Kind::message;
  ClientId client;
  std::optional<PreviewWish> previews{};
  std::string bytes{};
  int width = 0;  // of a preview
  Event preview{};
};

struct Subscriber {
  std::optional<PreviewWish> previews{};
  std::uint64_t previews_dropped = 0;
  std::chrono::steady_clock::time_point next_preview{};
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

// How soon a client that did not read is tried again.
constexpr long kTryAgain_ms = 20;
// At the end: how long clients have to take what waits.
constexpr int kLinger_ms = 1000;
// How often the list of allowed keys is looked at while nothing else happens.
constexpr long kLookAtList_ms = 500;

}  // namespace

struct Server::State {
  ServerOptions options;
  Handler handler;
  SocketFolder folder;
  Context context;
  std::vector<Door> doors;
  std::optional<Gate> gate;   // with a network only
  std::optional<Socket> zap;  // likewise
  std::string network_endpoint;
  LocalNames names;
  Outbox outbox;
  int wake_fd = -1;
  std::mutex mutex;
  std::deque<Outgoing> queue;
  std::atomic<bool> ending{false};
  std::atomic<std::size_t> subscribers_now{0};
  std::atomic<std::uint64_t> previews_dropped{0};
  std::map<ClientId, Subscriber> subscribers;  // of the socket thread alone
  std::set<int> widths;                        // of their previews; under the mutex
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
    for (const Door& door : doors) {
      std::error_code already_gone;
      if (!door.network) fs::remove(door.file, already_gone);
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
    if (send(doors[client.socket].socket, {client.routing, kMagic, bytes})) return Sent::yes;
    return errno == EHOSTUNREACH ? Sent::gone : Sent::full;
  }

  void forget(const ClientId& client) {
    subscribers.erase(client);
    count_subscribers();
  }

  void count_subscribers() {
    subscribers_now = subscribers.size();
    const std::lock_guard lock(mutex);
    widths.clear();
    for (const auto& [client, subscriber] : subscribers) {
      if (subscriber.previews) widths.insert(subscriber.previews->width);
    }
  }

  // A key may be taken off the list between a request and its answer.
  [[nodiscard]] bool may_hear(const ClientId& client) const {
    return !doors[client.socket].network || gate->find(client.key) != nullptr;
  }

  void carry_out(Outgoing& out) {
    if ((out.kind == Outgoing::Kind::message || out.kind == Outgoing::Kind::subscribe) &&
        !may_hear(out.client)) {
      return;
    }
    switch (out.kind) {
      case Outgoing::Kind::message:
        if (outbox.answer(out.client, out.bytes) == Sent::gone) forget(out.client);
        return;
      case Outgoing::Kind::subscribe:
        subscribers[out.client].previews = out.previews;
        count_subscribers();
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

  void carry_out_preview(Outgoing& out) {
    Event& event = out.preview;
    std::vector<ClientId> gone;
    for (auto& [client, subscriber] : subscribers) {
      if (!subscriber.previews || subscriber.previews->width != out.width) continue;
      const auto now = std::chrono::steady_clock::now();
      if (now < subscriber.next_preview) continue;
      subscriber.next_preview = now + subscriber.previews->every;
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

  void refuse(const ClientId& client, std::uint64_t id, const std::string& reason) {
    Reply reply;
    reply.set_id(id);
    reply.set_outcome(REFUSED);
    reply.set_reason(reason);
    if (outbox.answer(client, serialised(reply)) == Sent::gone) forget(client);
  }

  struct Sender {
    std::string name;
    Role role = Role::observer;
  };
  // Looked up anew for every message. Nothing: nobody who may send any.
  std::optional<Sender> sender(const Door& door, const Origin& origin) {
    if (door.network) {
      const AllowedKey* key = gate->find(origin.user_id);
      if (key == nullptr) return std::nullopt;
      return Sender{key->name, key->role};
    }
    const auto uid = peer_uid(origin.peer_address);
    if (!uid) return std::nullopt;
    // Who runs rigd, and root, can do with it what they like anyway.
    const bool master = *uid == 0 || *uid == ::geteuid();
    return Sender{names.of(*uid), door.most == Role::operator_ && master ? Role::admin : door.most};
  }

  void receive_all(std::size_t socket) {
    const Door& door = doors[socket];
    Origin origin;
    while (auto frames = receive(door.socket, &origin)) {
      if (frames->empty()) continue;
      const ClientId client{socket, (*frames)[0], origin.user_id};
      const std::vector<std::string_view> rest(frames->begin() + 1, frames->end());
      std::uint64_t id = 0;
      auto request = read_request(rest, id);
      const auto from = sender(door, origin);
      if (door.network) cut_off_namesakes(client);
      if (!from) {
        cut_off(client);
        refuse(client, id, "this key is not allowed (any more)");
      } else if (!request) {
        refuse(client, id, request.error().text());
      } else {
        handler({client, from->role, std::move(*request), from->name});
      }
    }
  }

  void cut_off(const ClientId& client) {
    forget(client);
    outbox.forget(client);
  }

  // A client chooses its routing id: what one of that name and another key had left here is not its own.
  void cut_off_namesakes(const ClientId& client) {
    const auto is_namesake = [&client](const ClientId& other) {
      return other.socket == client.socket && other.routing == client.routing && other.key != client.key;
    };
    std::erase_if(subscribers, [&](const auto& one) { return is_namesake(one.first); });
    count_subscribers();
    outbox.forget_if(is_namesake);
  }

  void look_at_list() {
    if (!gate) return;
    for (const AllowedKey& gone : gate->refresh()) {
      base::log_warning("'{}' is not allowed any more", gone.name);
      if (options.revoked) options.revoked(gone.name);
    }
    std::vector<ClientId> cut;
    for (const auto& [client, subscriber] : subscribers) {
      if (!may_hear(client)) cut.push_back(client);
    }
    for (const ClientId& client : cut) cut_off(client);
    outbox.forget_if([this](const ClientId& client) { return !may_hear(client); });
  }

  void answer_zap() {
    if (!zap) return;
    while (const auto request = receive(*zap)) {
      const auto reply = gate->answer(*request);
      if (!send(*zap, {reply.begin(), reply.end()}))
        base::log_error("a handshake could not be answered: {}", zmq_strerror(zmq_errno()));
    }
  }

  void run() {
    std::vector<zmq_pollitem_t> items{{nullptr, wake_fd, ZMQ_POLLIN, 0}};
    for (const Door& door : doors) items.push_back({door.socket.get(), 0, ZMQ_POLLIN, 0});
    if (zap) items.push_back({zap->get(), 0, ZMQ_POLLIN, 0});
    while (!ending) {
      zmq_poll(items.data(), static_cast<int>(items.size()),
               outbox.waiting() ? kTryAgain_ms : (gate ? kLookAtList_ms : -1));
      std::uint64_t count = 0;
      (void)!::read(wake_fd, &count, sizeof count);
      std::deque<Outgoing> out;
      {
        const std::lock_guard lock(mutex);
        out.swap(queue);
      }
      look_at_list();
      answer_zap();
      outbox.flush([this](const ClientId& client) { forget(client); });
      for (Outgoing& o : out) carry_out(o);
      for (std::size_t i = 0; i < doors.size(); ++i) receive_all(i);
    }
    // What was handed in before the end still goes out, to those who read it. Not under the lock: a client
    // that is found gone is forgotten, which takes it.
    std::deque<Outgoing> last;
    {
      const std::lock_guard lock(mutex);
      last.swap(queue);
    }
    for (Outgoing& o : last) carry_out(o);
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
  const auto add = [&state](Result<Door> door) -> Result<void> {
    if (!door) return base::pass(door);
    state->doors.push_back(std::move(*door));
    return {};
  };
  if (auto ok = add(open_local_door(state->context, state->folder, "observe.sock", Role::observer,
                                    options.observe_group, options));
      !ok) {
    return base::pass(ok);
  }
  if (auto ok = add(open_local_door(state->context, state->folder, "operate.sock", Role::operator_,
                                    options.operate_group, options));
      !ok) {
    return base::pass(ok);
  }
  if (options.network) {
    auto gate = Gate::open(options.network->allow_list);
    if (!gate) return base::pass(gate);
    state->gate = std::move(*gate);
    auto zap = open_zap_socket(state->context);
    if (!zap) return base::pass(zap);
    state->zap.emplace(std::move(*zap));
    if (auto ok = add(open_network_door(state->context, options)); !ok) return base::pass(ok);
    state->network_endpoint = state->doors.back().endpoint;
  }
  State* running = state.get();
  state->thread = std::thread([running] {
    base::name_thread("socket");
    running->run();
  });
  return std::unique_ptr<Server>(new Server(std::move(state)));
}

void Server::reply(const ClientId& client, const Reply& reply) {
  state_->hand_in({Outgoing::Kind::message, client, std::nullopt, serialised(reply)});
}
void Server::subscribe(const ClientId& client, std::optional<PreviewWish> previews) {
  state_->hand_in({Outgoing::Kind::subscribe, client, previews, {}});
}
void Server::unsubscribe(const ClientId& client) {
  state_->hand_in({Outgoing::Kind::unsubscribe, client, std::nullopt, {}});
}
void Server::publish(const Event& event) {
  state_->hand_in({Outgoing::Kind::event, {}, std::nullopt, serialised(event)});
}
void Server::publish_preview(Event event, int width) {
  state_->hand_in({Outgoing::Kind::preview, {}, std::nullopt, {}, width, std::move(event)});
}
std::set<int> Server::preview_widths() const {
  const std::lock_guard lock(state_->mutex);
  return state_->widths;
}
std::size_t Server::client_count() const {
  return state_->subscribers_now;
}
const std::string& Server::network_endpoint() const {
  return state_->network_endpoint;
}
std::uint64_t Server::previews_dropped() const {
  return state_->previews_dropped;
}

}  // namespace rig::protocol
