// Questions to a person, or to a script that answers in their place.
#pragma once

#include <string>

#include "core/base/result.h"

namespace rig::client {

class Dialogue {
 public:
  /// Reads answers, a line each, from a file descriptor; questions go to standard output.
  explicit Dialogue(int answers);

  void say(const std::string& text) const;
  /// The answer without the spaces around it. An Error where no more answers come, or on an interrupt, also
  /// while it waits.
  [[nodiscard]] base::Result<std::string> ask(const std::string& question);
  /// y, yes, n, no in any case; an empty answer is `fallback`. Anything else is asked again.
  [[nodiscard]] base::Result<bool> agrees(const std::string& question, bool fallback);

 private:
  int answers_;
  bool echo_;           // answers that nobody types are shown
  std::string buffer_;  // read, not yet asked for
};

}  // namespace rig::client
