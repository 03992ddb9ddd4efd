// Modbus RTU or TCP through libmodbus, one request at a time.
//
// What libmodbus 3.1.6 leaves to its caller, and is done here:
// - Its modes of error recovery stay off: they sleep and reconnect in the middle of a call.
// - The byte time-out is off, so that the response time-out bounds the whole answer; else each byte could
// take
//   that long again.
// - It selects on a descriptor without looking whether there is one, or whether it fits an fd_set.
// - Bytes that nobody asked for stay in the line and would be read as the next answer: what came in between
// is
//   dropped before every request. Whether an answer that is late belongs to this request RTU cannot say; Bus
//   has the rule for that. Over TCP libmodbus compares the transaction's number.
// - After an answer that was not this request's the right one may be on its way: it is given half the time of
//   an answer to come and be dropped, or each further answer would be one request behind.
// - Of a serial line it takes any speed that the system lets it set; what was really set is read back.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"
#include "drivers/modbus_axis/reading.h"
#include "drivers/modbus_axis/steps.h"

struct _modbus;  // libmodbus' context

namespace rig::drivers::modbus {

struct WireSettings {
  SerialSettings serial;  ///< RTU where it has a path
  std::string host;       ///< else TCP
  int tcp_port = 502;
  std::chrono::milliseconds answer{200};
  std::chrono::microseconds gap{0};  ///< silence before a request; RTU: at least 3.5 characters are kept

  [[nodiscard]] std::string where() const;
};

/// The protocol's 3.5 characters of 11 bits; above 19200 baud 1750 us.
[[nodiscard]] std::chrono::microseconds silent_interval(int baud);

/// Errors: `timeout` no answer; `damaged` one that cannot be this request's, or the drive is busy or found
/// the request garbled; `device` the drive refuses the request (an exception code of the protocol); `lost`
/// line or connection are gone.
class Wire {
 public:
  /// Of a call that has to be over by then, as all that follows.
  [[nodiscard]] static base::Result<std::unique_ptr<Wire>> open(const WireSettings& settings,
                                                                Deadline call_ends = Deadline::max());
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  [[nodiscard]] base::Result<std::vector<std::uint16_t>> read(int slave, const Block& block,
                                                              Deadline call_ends = Deadline::max());
  /// `single`: a single word with function 06.
  [[nodiscard]] base::Result<void> write(int slave, const Write& write, bool single,
                                         Deadline call_ends = Deadline::max());
  /// Without the longer silence after a garbled answer; on a line that never falls silent into the noise. Of
  /// two that speak at once the drive may understand one all the same.
  [[nodiscard]] base::Result<void> write_at_once(int slave, const Write& write, bool single,
                                                 Deadline call_ends = Deadline::max());

 private:
  struct Free {
    void operator()(_modbus* context) const;
  };
  using Context = std::unique_ptr<_modbus, Free>;

  Wire(WireSettings settings, Context context)
      : settings_(std::move(settings)),
        context_(std::move(context)),
        silence_(settings_.gap),
        within_(settings_.answer) {}
  [[nodiscard]] base::Result<void> set_up(Deadline call_ends);
  /// Keeps the silence before a request and drops what came uncalled for; false: there was none by then.
  [[nodiscard]] base::Result<bool> clear_line(std::chrono::microseconds silence, Deadline give_up);
  /// All of what precedes a request; afterwards its answer is waited for until then at the latest.
  [[nodiscard]] base::Result<void> prepare(Deadline call_ends);
  void wait_for_answer(Deadline call_ends);
  [[nodiscard]] base::Result<void> send(int slave, const Write& write, bool single);
  [[nodiscard]] tl::unexpected<base::Error> failed(int code, int slave, const std::string& doing);

  const WireSettings settings_;
  const Context context_;
  std::chrono::steady_clock::time_point quiet_since_{};
  std::chrono::microseconds silence_;  ///< before the next request
  std::chrono::milliseconds within_;   ///< of the present request's answer
};

}  // namespace rig::drivers::modbus
