// rigd on a virtual rig that takes pictures without end at the pace of the wall, and a client that looks on
// over TCP with CURVE.
#pragma once

#include <filesystem>
#include <optional>

#include "bench/base/latencies.h"
#include "core/base/result.h"
#include "protocol/client.h"
#include "tests/soak/rig_process.h"

namespace rig::bench {

class BusyRig {
 public:
  /// Running and subscribed when this returns, its first preview seen.
  [[nodiscard]] static base::Result<BusyRig> start(const std::filesystem::path& folder);

  /// Asks over TCP; whatever is not done is an Error.
  [[nodiscard]] base::Result<protocol::Reply> ask(const protocol::Request& request);
  /// Asks over the local socket.
  [[nodiscard]] base::Result<protocol::Reply> ask_locally(const protocol::Request& request);

  /// Takes what comes until then; false where the connection broke.
  bool pass_until(Steady::time_point time);
  /// Waits for the next preview; the size of its message.
  [[nodiscard]] base::Result<std::size_t> next_preview();
  [[nodiscard]] std::size_t previews() const { return previews_; }

  /// The job rests: nothing is taken, nothing sent.
  [[nodiscard]] base::Result<void> hold();
  /// It goes on, and its next preview has come.
  [[nodiscard]] base::Result<void> release();

  /// Stops; how long until the last of the four axes had got it. Then clears the stop and waits for the next
  /// preview.
  [[nodiscard]] base::Result<Steady::duration> stop_and_go_on();

 private:
  BusyRig(soak::RigProcess process, protocol::Client client, std::filesystem::path wire_log)
      : process_(std::move(process)), client_(std::move(client)), wire_log_(std::move(wire_log)) {}
  [[nodiscard]] base::Result<Steady::time_point> last_stop_after(Steady::time_point sent);
  soak::RigProcess process_;
  protocol::Client client_;
  std::filesystem::path wire_log_;
  std::streamoff wire_read_ = 0;  // of the wire log
  std::size_t previews_ = 0;
};

}  // namespace rig::bench
