#include "protocol/outbox.h"

#include <vector>

#include "core/base/log.h"

namespace rig::protocol {

Sent Outbox::answer(const ClientId& client, std::string bytes) {
  // Behind what waits already: a client gets everything in one order.
  if (boxes_.count(client) != 0) return keep(client, {true, std::move(bytes)});
  const Sent sent = send_(client, bytes);
  return sent == Sent::full ? keep(client, {true, std::move(bytes)}) : sent;
}

Sent Outbox::event(const ClientId& client, const std::string& bytes) {
  if (boxes_.count(client) != 0) return keep(client, {false, bytes});
  const Sent sent = send_(client, bytes);
  return sent == Sent::full ? keep(client, {false, bytes}) : sent;
}

Sent Outbox::preview(const ClientId& client, std::string_view bytes) {
  return boxes_.count(client) != 0 ? Sent::full : send_(client, bytes);
}

Sent Outbox::keep(const ClientId& client, Item item) {
  Box& box = boxes_[client];
  if (item.is_answer) {
    // One answer is always kept, however large.
    if (box.answers > 0 &&
        (box.answers >= limits_.answers || box.answer_bytes + item.bytes.size() > limits_.answer_bytes)) {
      return drop(client, box);
    }
    ++box.answers;
    box.answer_bytes += item.bytes.size();
  } else {
    // Once one is lost the later ones are too, until all that waits has been read: one gap, not many.
    if (box.events >= limits_.events || box.dropped > 0) return drop(client, box);
    ++box.events;
  }
  box.items.push_back(std::move(item));
  return Sent::yes;
}

Sent Outbox::drop(const ClientId& client, Box& box) {
  if (box.dropped == 0) {
    base::log_warning("a client (socket {}) does not read: {} messages wait, more are dropped", client.socket,
                      box.items.size());
  }
  ++box.dropped;
  ++dropped_;
  return Sent::full;
}

void Outbox::flush(const std::function<void(const ClientId&)>& gone) {
  std::vector<ClientId> lost;
  for (auto it = boxes_.begin(); it != boxes_.end();) {
    Box& box = it->second;
    Sent sent = Sent::yes;
    while (!box.items.empty()) {
      sent = send_(it->first, box.items.front().bytes);
      if (sent != Sent::yes) break;
      const Item& item = box.items.front();
      if (item.is_answer) {
        --box.answers;
        box.answer_bytes -= item.bytes.size();
      } else {
        --box.events;
      }
      box.items.pop_front();
    }
    if (sent == Sent::gone) lost.push_back(it->first);
    if (sent != Sent::gone && box.items.empty() && box.dropped > 0) {
      base::log_warning("a client (socket {}) reads again; it missed {} messages", it->first.socket,
                        box.dropped);
    }
    it = sent == Sent::gone || box.items.empty() ? boxes_.erase(it) : std::next(it);
  }
  for (const ClientId& client : lost) gone(client);
}

}  // namespace rig::protocol
