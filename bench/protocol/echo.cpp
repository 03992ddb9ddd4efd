#include "bench/protocol/echo.h"

#include <algorithm>
#include <array>

#include "protocol/envelope.h"

namespace rig::bench {

using std::chrono::milliseconds;

namespace {

constexpr std::size_t kKeyLetters = 40;

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

EchoServer::EchoServer(const EchoSizes& sizes) : sizes_(sizes) {
  const Keys keys = make_keys();
  public_key_ = keys.open;
  socket_.set(zmq::sockopt::linger, 0);
  socket_.set(zmq::sockopt::curve_server, true);
  socket_.set(zmq::sockopt::curve_secretkey, keys.secret);
  socket_.bind("tcp://127.0.0.1:*");
  endpoint_ = socket_.get(zmq::sockopt::last_endpoint);
  thread_ = std::thread([this] { run(); });
}

EchoServer::~EchoServer() {
  ending_ = true;
  thread_.join();
}

void EchoServer::run() {
  constexpr milliseconds kLookUp{20};  // whether it is to end, or to stream
  const std::string reply = body_of(sizes_.reply_bytes);
  const std::string preview = body_of(sizes_.preview_bytes);
  std::string client;
  auto next = Steady::now();
  while (!ending_) {
    const auto now = Steady::now();
    if (streaming_ && !client.empty() && now >= next) {
      send(socket_, client, true);
      send(socket_, protocol::kMagic, true);
      send(socket_, preview, false);
      next = std::max(next + sizes_.preview_every, now);
    }
    zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
    const auto until_next = std::chrono::ceil<milliseconds>(next - Steady::now());
    zmq::poll(&item, 1, streaming_ ? std::clamp(until_next, milliseconds(0), kLookUp) : kLookUp);
    zmq::message_t part;
    while (socket_.recv(part, zmq::recv_flags::dontwait)) {
      client = part.to_string();
      while (part.more()) (void)socket_.recv(part);
      send(socket_, client, true);
      send(socket_, protocol::kMagic, true);
      send(socket_, reply, false);
    }
  }
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
