// That an axis has lost its reference, remembered over restarts.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/log.h"

namespace rig::drivers::sixk {

/// Only ever takes away: that an axis is homed says the controller alone. It goes on saying so after a motor
/// has stalled or was without current, when its counted steps mean nothing any more; that is kept in a file
/// until the next search for home succeeds.
class Reference {
 public:
  using Log = void (*)(base::LogLevel, std::string_view);
  Reference(const std::filesystem::path& folder, const std::string& axis, Log log);

  [[nodiscard]] bool is_lost() const { return lost_; }
  void lose(const std::string& why);
  void found();

 private:
  void tell(const std::string& what) const;

  const std::filesystem::path file_;
  const Log log_;
  bool lost_;
};

}  // namespace rig::drivers::sixk
