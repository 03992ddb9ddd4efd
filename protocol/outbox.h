// What waits for clients that do not read as fast as they are sent to. Private to protocol.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "protocol/server.h"

namespace rig::protocol {

/// How an attempt to send without blocking ended.
enum class Sent { yes, full, gone };

/// Sends in order what can be sent and keeps the rest, for each client on its own: answers are kept before
/// all, events up to a number, previews not at all. What does not fit is dropped and counted for that client
/// alone. ZeroMQ's own queue per client is therefore kept short: it can neither be looked into nor be bounded
/// in bytes.
class Outbox {
 public:
  using Send = std::function<Sent(const ClientId&, std::string_view)>;
  struct Limits {
    std::size_t events = 1000;                         ///< waiting for one client
    std::size_t answers = 1000;                        ///< waiting for one client
    std::size_t answer_bytes = std::size_t{64} << 20;  ///< waiting for one client
  };

  Outbox(Limits limits, Send send) : limits_(limits), send_(std::move(send)) {}

  // Each returns gone where the client has no connection any more (nothing is kept of it then), full where
  // the message was dropped.
  Sent answer(const ClientId& client, std::string bytes);
  Sent event(const ClientId& client, const std::string& bytes);
  Sent preview(const ClientId& client, std::string_view bytes);

  /// Drops what waits for a client.
  void forget(const ClientId& client) { boxes_.erase(client); }
  template <typename Wanted>
  void forget_if(Wanted wanted) {
    std::erase_if(boxes_, [&](const auto& box) { return wanted(box.first); });
  }

  /// Tries again what waits. Calls `gone` for every client that was found to have none.
  void flush(const std::function<void(const ClientId&)>& gone);

  [[nodiscard]] bool waiting() const { return !boxes_.empty(); }
  /// Events and answers that were dropped, of all clients since the start.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  struct Item {
    bool is_answer = false;
    std::string bytes;
  };
  struct Box {
    std::deque<Item> items;
    std::size_t events = 0;
    std::size_t answers = 0;
    std::size_t answer_bytes = 0;
    std::uint64_t dropped = 0;
  };

  Sent keep(const ClientId& client, Item item);
  Sent drop(const ClientId& client, Box& box);

  const Limits limits_;
  const Send send_;
  std::map<ClientId, Box> boxes_;  // of clients for whom something waits
  std::uint64_t dropped_ = 0;
};

}  // namespace rig::protocol
