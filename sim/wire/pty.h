// A serial line without a cable: a pseudo-terminal, whose far end a driver opens by its path.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace rig::sim::wire {

/// The device's end. The path that drivers open is a link, so that a line that was cut comes back under the
/// name it had.
class Pty {
 public:
  /// `link` is made and points at the terminal.
  explicit Pty(std::filesystem::path link);
  ~Pty();
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return link_; }

  /// What has come, waiting up to `within` for it; empty: nothing, or nobody has the line open.
  [[nodiscard]] std::string read(std::chrono::milliseconds within);
  /// Writes all of it; what nobody reads is dropped when the terminal is full.
  void write(std::string_view bytes);

  /// As when the adapter is unplugged: the driver's end hangs up and the link is gone. restore() makes a new
  /// terminal under the old link. read and write do nothing in between. Any thread may call them.
  void cut();
  void restore();
  [[nodiscard]] bool is_cut();

 private:
  void make();

  const std::filesystem::path link_;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rig::sim::wire
