// One wire with the drives on it: retries, and the rule that an answer which is late never passes for the
// answer to a later question.
//
// RTU has no number that ties an answer to its question: an answer that comes after its time-out looks like
// that of the next question of the same kind and length. So after a time-out or a garbled answer the drive is
// *in doubt*, and before the next question it is asked one whose answer has another length than all that may
// yet come. A drive answers in the order in which it was asked, so once that answer is there nothing older
// can follow; what comes in its place is dropped as garbled, and it is asked again. Writes that must reach
// the drive at once (stops) are sent without that first.
#pragma once

#include <optional>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/common/connection.h"
#include "drivers/common/retry.h"
#include "drivers/modbus_axis/wire.h"

namespace rig::drivers::modbus {

/// A drive on the bus, as the bus sees it. Its axis holds it.
struct Peer {
  int slave = 1;
  bool one_word_single = false;
  std::vector<Block> known;  ///< registers that it has for sure, for the question that clears a doubt

  /// An answer that may yet come: so many words, 0 for that of a write.
  struct Doubt {
    std::size_t words;
    base::Time since;
  };
  std::vector<Doubt> doubts = {};
  std::optional<base::Error> lost = std::nullopt;  ///< it does not answer
  base::Time ask_again{};                          ///< while it is lost
  int times_lost = 0;
};

/// The question that clears the peer's doubts: one of the blocks that it knows, or a part of one, whose
/// answer is none of those that may yet come; where there is none left, the one doubted longest.
[[nodiscard]] Block clearing_question(const Peer& peer);

/// For the one worker of the bus.
class Bus {
 public:
  Bus(WireSettings settings, RetryPolicy policy, base::Clock& clock);

  /// All that follows belongs to a call that begins now.
  void begin_call() { call_ends_ = policy_.call_ends(); }
  /// What is left of the call beyond the time of one answer.
  [[nodiscard]] base::Duration time_to_spare() const {
    return call_ends_ - policy_.answer - std::chrono::steady_clock::now();
  }

  /// A drive that does not answer is `lost`, and for half a second so is every further request, at once: the
  /// others on the wire need not wait for it each time. After that one attempt is made, not all.
  [[nodiscard]] base::Result<std::vector<std::uint16_t>> read(Peer& peer, const Block& block);
  [[nodiscard]] base::Result<void> write(Peer& peer, const Write& write);
  /// Sent once, for what may not be done twice. Whether it was done is open where no answer comes.
  [[nodiscard]] base::Result<void> write_once(Peer& peer, const Write& write);
  /// Goes out before anything else is cleared up, also to a drive that is lost, on a line that chatters, and
  /// when the call's time is over.
  [[nodiscard]] base::Result<void> write_at_once(Peer& peer, const Write& write);

  /// Grows when the wire was opened again.
  [[nodiscard]] int times_opened() const { return connection_.times_opened(); }

 private:
  template <typename Send>
  [[nodiscard]] auto ask(Peer& peer, std::size_t answer_words, bool clear_first, Deadline ends, Send&& send)
      -> decltype(send(std::declval<Wire&>()));
  [[nodiscard]] base::Result<void> clear_doubts(Wire& wire, Peer& peer, Deadline ends);
  void note(Peer& peer, const base::Error* error);

  const WireSettings settings_;
  const RetryPolicy policy_;
  base::Clock& clock_;
  Deadline call_ends_ = Deadline::max();
  Connection<Wire> connection_;
  int silent_in_a_row_ = 0;
};

}  // namespace rig::drivers::modbus
