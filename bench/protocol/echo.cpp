#include "bench/protocol/echo.h"

#include <algorithm>
#include <array>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "protocol/envelope.h"

namespace rig::bench {

using std::chrono::milliseconds;

namespace {

constexpr std::size_t kKeyLetters = 40;

struct Order {
  EchoSizes sizes;
  bool streaming = false;
};

struct Keys {
  std::string open, secret;
};

Keys make_keys() {
  std::array<char, kKeyLetters + 1> open{};
  std::array<char, kKeyLetters + 1> secret{};
  zmq_curve_keypair(open.data(), secret.data());
  return {open.data(), secret.data()};
}

void send(zmq::socket_t& socket, std::string_view bytes, bool more) {
  socket.send(zmq::const_buffer(bytes.data(), bytes.size()),
              more ? zmq::send_flags::sndmore : zmq::send_flags::none);
}

// Bytes that are not all the same; what they are matters to nobody.
std::string body_of(std::size_t size) {
  std::string body(size, '\0');
  for (std::size_t i = 0; i < size; ++i) body[i] = static_cast<char>(i * 31);
  return body;
}

}  // namespace

// The process of an EchoServer.
class EchoProcess {
 public:
  explicit EchoProcess(int orders) : orders_(orders) {
    const Keys keys = make_keys();
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::curve_server, true);
    socket_.set(zmq::sockopt::curve_secretkey, keys.secret);
    socket_.bind("tcp://127.0.0.1:*");
    EchoServer::Address address;
    socket_.get(zmq::sockopt::last_endpoint).copy(address.endpoint.data(), address.endpoint.size() - 1);
    keys.open.copy(address.public_key.data(), address.public_key.size() - 1);
    (void)!::write(orders_, &address, sizeof address);
  }

  // Until nobody gives orders any more.
  void run() {
    while (true) {
      const auto now = Steady::now();
      if (order_.streaming && !client_.empty() && now >= next_) {
        answer(preview_);
        next_ = std::max(next_ + order_.sizes.preview_every, now);
      }
      std::array<zmq::pollitem_t, 2> items{
          {{socket_.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, orders_, ZMQ_POLLIN, 0}}};
      const auto until_next = std::chrono::ceil<milliseconds>(next_ - Steady::now());
      zmq::poll(items.data(), items.size(),
                order_.streaming ? std::max(until_next, milliseconds(0)) : milliseconds(-1));
      if (items[1].revents != 0 && !take_order()) return;
      zmq::message_t part;
      while (socket_.recv(part, zmq::recv_flags::dontwait)) {
        client_ = part.to_string();
        while (part.more()) (void)socket_.recv(part);
        answer(reply_);
      }
    }
  }

 private:
  void answer(const std::string& body) {
    send(socket_, client_, true);
    send(socket_, protocol::kMagic, true);
    send(socket_, body, false);
  }
  bool take_order() {
    if (::read(orders_, &order_, sizeof order_) != sizeof order_) return false;
    reply_ = body_of(order_.sizes.reply_bytes);
    preview_ = body_of(order_.sizes.preview_bytes);
    next_ = Steady::now();
    return true;
  }

  int orders_;
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::router};
  Order order_;
  std::string reply_, preview_;
  std::string client_;
  Steady::time_point next_;
};

base::Result<EchoServer> EchoServer::start() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return base::fail(base::ErrorCode::io, "no socket for the echo");
  EchoServer server(::fork(), ends[0]);
  if (server.pid_ == 0) {
    ::close(ends[0]);
    EchoProcess(ends[1]).run();
    ::_exit(0);
  }
  ::close(ends[1]);
  if (::read(server.orders_, &server.address_, sizeof server.address_) != sizeof server.address_)
    return base::fail(base::ErrorCode::io, "the echo does not begin");
  return server;
}

EchoServer::~EchoServer() {
  if (orders_ >= 0) ::close(orders_);
  if (pid_ > 0) (void)::waitpid(pid_, nullptr, 0);
}

void EchoServer::order(const EchoSizes& sizes, bool streaming) const {
  const Order order{sizes, streaming};
  (void)!::write(orders_, &order, sizeof order);
}

EchoClient::EchoClient(const EchoServer& server, const EchoSizes& sizes) : sizes_(sizes) {
  const Keys keys = make_keys();
  socket_.set(zmq::sockopt::linger, 0);
  socket_.set(zmq::sockopt::curve_serverkey, server.public_key());
  socket_.set(zmq::sockopt::curve_publickey, keys.open);
  socket_.set(zmq::sockopt::curve_secretkey, keys.secret);
  socket_.connect(server.endpoint());
}

std::size_t EchoClient::take(Steady::time_point until) {
  zmq::message_t part;
  while (!socket_.recv(part, zmq::recv_flags::dontwait)) {
    const auto left = std::chrono::ceil<milliseconds>(until - Steady::now());
    if (left.count() <= 0) return 0;
    zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
    zmq::poll(&item, 1, left);
  }
  while (part.more()) (void)socket_.recv(part);
  const bool is_preview = part.size() == sizes_.preview_bytes;
  previews_ += is_preview ? 1 : 0;
  return part.size();
}

bool EchoClient::ask() {
  constexpr std::chrono::seconds kPatience{10};
  const std::string request(sizes_.request_bytes, 'r');
  send(socket_, protocol::kMagic, true);
  send(socket_, request, false);
  const auto until = Steady::now() + kPatience;
  while (true) {
    const std::size_t size = take(until);
    if (size == 0 || size == sizes_.reply_bytes) return size != 0;
  }
}

bool EchoClient::pass_until(Steady::time_point time) {
  while (Steady::now() < time) (void)take(time);
  return true;
}

}  // namespace rig::bench
