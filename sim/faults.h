// When and whether something goes wrong now.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/fault_plan.h"

namespace rig::sim {

/// The faults of the settings and those of a file that may appear, change and go while rigd runs. May be
/// asked from any thread.
class Faults {
 public:
  using Complain = std::function<void(const std::string&)>;

  /// The file need not exist. One that cannot be read as faults is complained about once, and the faults that
  /// it had before stay.
  Faults(FaultPlan settings, std::filesystem::path file, Complain complain);

  /// One occasion for a fault of this kind at this device, `world_s` after the world was made. The amount of
  /// the first that strikes; nothing where none does.
  [[nodiscard]] std::optional<double> strike(FaultKind kind, std::string_view device, double world_s);

  /// The same for the switch at one end of an axis: that of the drive or that of the lines, as `kind` says.
  [[nodiscard]] bool strike_switch(FaultKind kind, std::string_view axis, bool high_side, double world_s);

  /// Whether there is any fault of this kind: no occasion for one. Where many could ask, none needs to.
  [[nodiscard]] bool has_any(FaultKind kind);

 private:
  struct Watched {
    Fault fault;
    std::uint64_t key = 0;
    std::uint64_t occasions = 0, struck = 0;
  };
  using Matches = std::function<bool(const Fault&)>;

  void look_at_file();
  [[nodiscard]] std::optional<double> strike_first(const Matches& matches, double world_s);
  [[nodiscard]] static std::vector<Watched> watch(const FaultPlan& plan, std::uint64_t stream);

  std::mutex mutex_;
  std::filesystem::path file_;
  Complain complain_;
  std::vector<Watched> settings_, from_file_;
  std::string seen_;  // which version of the file was read
};

}  // namespace rig::sim
