// A board of general-purpose lines behind a socket, in the place of a gpiochip of the kernel (its protocol is
// in docs/drivers/gpiod_lines.md). It keeps of each line what the kernel keeps: 16 changes, of which the
// oldest stay when more come; the direction and level when its user goes.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace rig::sim::wire {

class LineBoard {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Listens at `socket`. Lines are offsets 0, 1, ... with these names ("" for none); all are inputs with
  /// nothing connected to them.
  LineBoard(std::filesystem::path socket, std::vector<std::string> names);
  ~LineBoard();
  LineBoard(const LineBoard&) = delete;
  LineBoard& operator=(const LineBoard&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const;

  /// What is wired to the line drives it to that level; nothing: lets it go, so that its bias decides, or its
  /// own driver. An output's pin follows whatever drives it from outside: a short circuit.
  void drive(unsigned int line, std::optional<bool> high);
  /// Drives it to these levels one after the other, all at one instant of the changes' time.
  void drive_burst(unsigned int line, const std::vector<bool>& highs);
  /// Drives it to the level and back; the changes' times are so far apart, and the last is now.
  void drive_for(unsigned int line, bool high, std::chrono::nanoseconds held);

  /// The pin.
  [[nodiscard]] bool high(unsigned int line);
  [[nodiscard]] bool is_output(unsigned int line);
  [[nodiscard]] bool is_taken(unsigned int line);

  /// Returns when the line's level was asked for so many times from now on.
  void await_looks(unsigned int line, int looks);

  struct Change {
    Time at;
    bool high;
  };
  /// How an output's own driver changed its pin since the line was made or this was asked before.
  [[nodiscard]] std::vector<Change> changes(unsigned int line);

  /// The next so many requests are answered with this errno.
  void fail_next(int requests, int error);
  /// The next so many requests are answered with these bytes.
  void garble_next(int requests, const std::string& answer);

  /// What becomes of answers to requests that were obeyed.
  enum class Spoil { missing, garbage, late, duplicate, two_of_three };
  /// So of the next so many; 0: of none. A late one comes so much later; of two_of_three two never come.
  void spoil(Spoil how, int answers, std::chrono::milliseconds lateness = std::chrono::milliseconds(700));

  /// As when the bridge is unplugged: connections end and the socket is gone. After restore() all lines are
  /// inputs again; what is wired to them stays.
  void cut();
  void restore();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rig::sim::wire
