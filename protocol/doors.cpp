#include "protocol/doors.h"

#include <cerrno>
#include <cstring>
#include <sys/stat.h>

#include "protocol/gate.h"
#include "protocol/keys.h"

namespace rig::protocol {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// ZeroMQ keeps this many messages for a client itself; what is beyond waits in the outbox, where it is
// bounded and counted.
constexpr int kShortQueue = 16;
// At the end: how long ZeroMQ may take to hand over what was sent.
constexpr int kLinger_ms = 1000;
// Who connects over the network and does not finish the handshake by then is cut off.
constexpr int kHandshake_ms = 5000;
// A connection on which nothing moves is probed, and ended where no answer comes.
constexpr int kHeartbeatEvery_ms = 5000;
constexpr int kHeartbeatPatience_ms = 15000;
constexpr int kBacklog = 32;
// ZMQ_ZAP_ENFORCE_DOMAIN. Debian's zmq.h hides the name with the drafts, its library knows the option; that
// it took it is checked.
constexpr int kZapEnforceDomain = 93;

Socket router(const Context& context, const ServerOptions& options) {
  Socket socket(context, ZMQ_ROUTER);
  socket.set(ZMQ_ROUTER_MANDATORY, 1);
  socket.set(ZMQ_SNDHWM, kShortQueue);
  socket.set(ZMQ_LINGER, kLinger_ms);
  socket.set_wide(ZMQ_MAXMSGSIZE, static_cast<long long>(options.max_message_bytes));
  return socket;
}

}  // namespace

Result<Door> open_local_door(const Context& context, const SocketFolder& folder, const char* file, Role most,
                             const std::string& group, const ServerOptions& options) {
  const auto path = folder.make_way(file);
  if (!path) return pass(path);
  Door door{router(context, options), false, most, *path, {}};
  // Nobody but the owner may connect before the group is right.
  const mode_t before = ::umask(0177);
  const int bound = zmq_bind(door.socket.get(), ("ipc://" + path->string()).c_str());
  ::umask(before);
  if (bound != 0)
    return fail(ErrorCode::io, fmt::format("cannot listen: {}", zmq_strerror(zmq_errno())), path->string());
  if (auto given = give_to_group(*path, group); !given) return pass(given);
  return door;
}

Result<Door> open_network_door(const Context& context, const ServerOptions& options) {
  const NetworkDoor& network = *options.network;
  const auto keys = read_key_file(network.key_file);
  if (!keys) return pass(keys);
  Door door{router(context, options), true, Role::observer, {}, {}};
  const Socket& socket = door.socket;
  if (network.endpoint.find('[') != std::string::npos) socket.set(ZMQ_IPV6, 1);
  socket.set(ZMQ_BACKLOG, kBacklog);
  socket.set(ZMQ_HANDSHAKE_IVL, kHandshake_ms);
  socket.set(ZMQ_HEARTBEAT_IVL, kHeartbeatEvery_ms);
  socket.set(ZMQ_HEARTBEAT_TIMEOUT, kHeartbeatPatience_ms);
  const bool guarded = socket.require(ZMQ_CURVE_SERVER, 1) &&
                       socket.require(ZMQ_CURVE_SECRETKEY, keys->secret_key) &&
                       socket.require(ZMQ_ZAP_DOMAIN, kZapDomain) && socket.require(kZapEnforceDomain, 1);
  if (!guarded) {
    return fail(ErrorCode::io, "this ZeroMQ cannot guard a socket by keys", network.endpoint,
                "remove [network] from rig.toml, or install Debian's libzmq5");
  }
  if (zmq_bind(socket.get(), network.endpoint.c_str()) != 0) {
    return fail(ErrorCode::io, fmt::format("cannot listen: {}", zmq_strerror(zmq_errno())), network.endpoint);
  }
  std::array<char, 256> bound{};
  std::size_t size = bound.size();
  zmq_getsockopt(socket.get(), ZMQ_LAST_ENDPOINT, bound.data(), &size);
  door.endpoint = bound.data();
  return door;
}

Result<Socket> open_zap_socket(const Context& context) {
  Socket socket(context, ZMQ_REP);
  if (zmq_bind(socket.get(), "inproc://zeromq.zap.01") != 0) {
    return fail(ErrorCode::io,
                fmt::format("cannot answer for the keys of clients: {}", zmq_strerror(zmq_errno())));
  }
  return socket;
}

}  // namespace rig::protocol
