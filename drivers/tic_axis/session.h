// A Tic that is there: met, compared with rig.toml, and fed, until it is gone.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/base/log.h"
#include "drivers/tic_axis/feeder.h"
#include "drivers/tic_axis/link.h"
#include "drivers/tic_axis/settings.h"

namespace rig::drivers::tic {

class Session {
 public:
  using Log = std::function<void(base::LogLevel, const std::string&)>;

  /// Looks for the Tic, reads what it is and how it is set up, forgets the errors of the time before (which
  /// are logged), and begins to feed it. With write_settings it is set up first. A Tic that is not set up as
  /// it must be is no error here: it can be read and stopped; see mismatch(). All within the call that it is
  /// opened in.
  [[nodiscard]] static base::Result<std::unique_ptr<Session>> open(const TicSettings& tic,
                                                                   const ModuleSettings& module,
                                                                   const Heartbeat& heart, const Log& log,
                                                                   Deadline call_ends);

  [[nodiscard]] Link& link() { return *link_; }
  [[nodiscard]] const Settings& settings() const { return settings_; }
  /// Why it may not move, with the commands that mend it; empty: it may.
  [[nodiscard]] const std::string& mismatch() const { return mismatch_; }
  /// Reads the Tic's settings again: what did not agree was mended meanwhile. A new session knows it then.
  [[nodiscard]] bool is_mended(const TicSettings& tic);

 private:
  Session() = default;

  std::unique_ptr<Link> link_;
  Settings settings_;
  std::string mismatch_;
  std::unique_ptr<Feeder> feeder_;  // ends before the link that it feeds
};

}  // namespace rig::drivers::tic
