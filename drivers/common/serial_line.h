// A serial line: raw bytes with deadlines.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/config.h"
#include "core/base/result.h"

namespace rig::drivers {

struct SerialSettings {
  std::string path;  ///< "/dev/serial/by-id/..."
  int baud = 9600;
  char parity = 'N';  ///< 'N', 'E' or 'O'
  int stop_bits = 1;  ///< 1 or 2
};

/// The keys `port`, `baud`, `parity` ("none", "even", "odd") and `stop_bits`; what is absent is as in
/// `usual`.
[[nodiscard]] SerialSettings read_serial_settings(const base::ConfigTable& settings,
                                                  const SerialSettings& usual);

/// Raw mode, no flow control, eight data bits; this process alone has the line. A line that is gone (adapter
/// unplugged) answers `lost`.
class SerialLine {
 public:
  /// What the line cannot do (a speed, a parity), and a line that somebody else has, is an error.
  [[nodiscard]] static base::Result<std::unique_ptr<SerialLine>> open(const SerialSettings& settings);
  ~SerialLine();
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

  [[nodiscard]] base::Result<void> write(std::string_view bytes, std::chrono::milliseconds within);
  /// What comes up to the first `end`, which is taken off the line and not handed back. What has come before
  /// a time-out stays for the next call; more than `most` bytes without an end are `damaged` and dropped.
  [[nodiscard]] base::Result<std::string> read_until(char end, std::chrono::milliseconds within,
                                                     std::size_t most = 4096);
  /// Exactly `count` bytes.
  [[nodiscard]] base::Result<std::string> read_exactly(std::size_t count, std::chrono::milliseconds within);
  /// What has come by `deadline` at the latest: as soon as there is anything. Empty: nothing came.
  [[nodiscard]] base::Result<std::string> read_some(std::chrono::steady_clock::time_point deadline);
  /// Whatever has come so far, possibly nothing; does not wait. Of a line that never falls silent about a
  /// tenth of a megabyte at a time.
  [[nodiscard]] base::Result<std::string> read_waiting();
  /// Drops what has come and nobody read.
  void discard_input();

  [[nodiscard]] const std::string& path() const { return settings_.path; }

 private:
  SerialLine(SerialSettings settings, int fd) : settings_(std::move(settings)), fd_(fd) {}
  /// Waits for more bytes and takes them in; false: none until the deadline.
  [[nodiscard]] base::Result<bool> take_in(std::chrono::steady_clock::time_point deadline);
  [[nodiscard]] tl::unexpected<base::Error> lost(const std::string& why) const;

  const SerialSettings settings_;
  const int fd_;
  std::string come_;
};

}  // namespace rig::drivers
