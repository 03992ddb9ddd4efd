#include "drivers/modbus_axis/bus.h"

#include <algorithm>

namespace rig::drivers::modbus {

using base::ErrorCode;
using base::pass;
using base::Result;

namespace {

constexpr base::Duration kLostFor = std::chrono::milliseconds(500);
// No drive, converter or gateway keeps an answer back for so long.
constexpr base::Duration kLongestDelay = base::seconds(10);
// When nobody on the wire has answered so many requests, the adapter may be what hangs: it is opened anew.
constexpr int kSilentBeforeReopening = 4;

bool leaves_doubt(const base::Error& error) {
  return error.code == ErrorCode::timeout || error.code == ErrorCode::damaged;
}

}  // namespace

Block clearing_question(const Peer& peer) {
  Block widest;
  for (const Block& block : peer.known) {
    if (block.count >= widest.count) widest = block;
  }
  std::vector<Block> questions = peer.known;
  for (std::uint16_t count = 1; count < widest.count; ++count) {
    questions.push_back({widest.table, widest.address, count});
  }
  // One word more may not exist; that the drive refuses it is as good an answer.
  questions.push_back({widest.table, widest.address, static_cast<std::uint16_t>(widest.count + 1)});
  // Doubts stand in the order of time.
  const auto doubted_at = [&peer](const Block& block) {
    const auto same = [&block](const Peer::Doubt& doubt) { return doubt.words == block.count; };
    const auto last = std::find_if(peer.doubts.rbegin(), peer.doubts.rend(), same);
    return last == peer.doubts.rend() ? base::Time{} : last->since;
  };
  return *std::min_element(questions.begin(), questions.end(),
                           [&](const Block& a, const Block& b) { return doubted_at(a) < doubted_at(b); });
}

Bus::Bus(WireSettings settings, RetryPolicy policy, base::Clock& clock)
    : settings_(std::move(settings)),
      policy_(policy),
      clock_(clock),
      connection_([this] { return Wire::open(settings_, call_ends_); }, clock) {}

Result<void> Bus::clear_doubts(Wire& wire, Peer& peer, Deadline ends) {
  const base::Time now = clock_.now();
  std::erase_if(peer.doubts, [now](const Peer::Doubt& doubt) { return now - doubt.since > kLongestDelay; });
  if (peer.doubts.empty()) return {};
  const Block question = clearing_question(peer);
  const auto answer = wire.read(peer.slave, question, ends);
  if (!answer && answer.error().code != ErrorCode::device) {
    if (leaves_doubt(answer.error())) peer.doubts.push_back({question.count, now});
    return pass(answer);
  }
  peer.doubts.clear();
  return {};
}

void Bus::note(Peer& peer, const base::Error* error) {
  if (error == nullptr || error->code != ErrorCode::lost) {
    peer.lost.reset();
    silent_in_a_row_ = 0;
    return;
  }
  if (!peer.lost) ++peer.times_lost;
  peer.lost = *error;
  peer.ask_again = clock_.now() + kLostFor;
  if (++silent_in_a_row_ < kSilentBeforeReopening) return;
  silent_in_a_row_ = 0;
  connection_.close();
}

template <typename Send>
auto Bus::ask(Peer& peer, std::size_t answer_words, bool clear_first, Deadline ends, Send&& send)
    -> decltype(send(std::declval<Wire&>())) {
  RetryPolicy policy = policy_;
  if (peer.lost) policy.attempts = 1;
  // The wire keeps the time of each attempt, which begins when the line is free.
  auto answer = with_retries(policy, ends, settings_.where(), [&](Deadline) {
    return connection_.use([&](Wire& wire) -> decltype(send(wire)) {
      if (clear_first) {
        if (auto clear = clear_doubts(wire, peer, ends); !clear) return pass(clear);
      }
      auto one = send(wire);
      if (!one && leaves_doubt(one.error())) peer.doubts.push_back({answer_words, clock_.now()});
      return one;
    });
  });
  note(peer, answer ? nullptr : &answer.error());
  return answer;
}

Result<std::vector<std::uint16_t>> Bus::read(Peer& peer, const Block& block) {
  if (peer.lost && clock_.now() < peer.ask_again) return tl::unexpected<base::Error>(*peer.lost);
  return ask(peer, block.count, true, call_ends_,
             [&](Wire& wire) { return wire.read(peer.slave, block, call_ends_); });
}

Result<void> Bus::write(Peer& peer, const Write& write) {
  if (peer.lost && clock_.now() < peer.ask_again) return tl::unexpected<base::Error>(*peer.lost);
  return ask(peer, 0, true, call_ends_,
             [&](Wire& wire) { return wire.write(peer.slave, write, peer.one_word_single, call_ends_); });
}

Result<void> Bus::write_once(Peer& peer, const Write& write) {
  if (peer.lost && clock_.now() < peer.ask_again) return tl::unexpected<base::Error>(*peer.lost);
  bool sent = false;
  return ask(peer, 0, true, call_ends_, [&](Wire& wire) -> Result<void> {
    if (std::exchange(sent, true)) {
      return fail(ErrorCode::device,
                  fmt::format("no whole answer to a write to 0x{:04X}: whether it was done "
                              "is open, and it is not sent twice",
                              write.address));
    }
    return wire.write(peer.slave, write, peer.one_word_single, call_ends_);
  });
}

Result<void> Bus::write_at_once(Peer& peer, const Write& write) {
  const Deadline ends = policy_.stop_ends(call_ends_);
  const auto send = [&](Wire& wire) {
    return wire.write_at_once(peer.slave, write, peer.one_word_single, ends);
  };
  // The answer to a reading cannot pass for that to a writing. Of those to earlier writings it cannot be
  // said: then the answer proves nothing, and the stop goes out again when the doubt is cleared.
  const bool of_a_write = std::any_of(peer.doubts.begin(), peer.doubts.end(),
                                      [](const Peer::Doubt& doubt) { return doubt.words == 0; });
  if (!of_a_write) return ask(peer, 0, false, ends, send);
  const auto sent = connection_.use(send);
  if (!sent && peer.lost) return tl::unexpected<base::Error>(*peer.lost);
  return ask(peer, 0, true, call_ends_, send);
}

}  // namespace rig::drivers::modbus
