// What a device of the wire says over its line, and how that is spoilt on command.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include "sim/wire/pty.h"

namespace rig::sim::wire {

/// Not for several threads: its device's lock guards it.
class Answers {
 public:
  using Time = std::chrono::steady_clock::time_point;
  enum class Spoil {
    missing,       ///< it never comes
    garbage,       ///< as many other bytes come in its place
    late,          ///< it comes `lateness` after its time
    duplicate,     ///< it comes twice
    two_of_three,  ///< only each third comes
  };

  Answers(Pty& line, std::chrono::milliseconds lateness) : line_(line), lateness_(lateness) {}

  /// So many answers from now on are spoilt like this; an older order to spoil is forgotten.
  void spoil(Spoil how, int answers);
  void forget();

  /// One whole answer to one command.
  void send(Time now, std::string_view answer);
  /// What is no answer is never spoilt: a banner, a message that nobody asked for, an echo.
  void say(std::string_view text) { line_.write(text); }
  /// Late answers that are due are sent. Called again and again.
  void tick(Time now);

 private:
  struct Late {
    Time due;
    std::string bytes;
  };

  Pty& line_;
  const std::chrono::milliseconds lateness_;
  Spoil how_ = Spoil::missing;
  int to_spoil_ = 0;
  std::uint32_t noise_ = 1;
  std::deque<Late> late_;
};

}  // namespace rig::sim::wire
