// A module while it is open, and the one device of it that a check is about.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/conformance/bench.h"
#include "drivers/conformance/ending.h"
#include "drivers/conformance/waiting.h"

namespace rig::drivers::conformance {

/// How long a device that came back, or whose answers are whole again, may take until it answers the same
/// Device object.
inline constexpr base::Duration kBackWithin = std::chrono::seconds(10);
/// How long it may take until a device that is gone is called lost.
inline constexpr base::Duration kLostWithin = std::chrono::seconds(5);
/// The longest one call may take, whatever the wire does: rigd's own deadlines for a call (1 s of an axis and
/// of lines, 2 s of a camera and of a light), and what a busy machine adds. A frame is transferred meanwhile.
inline constexpr base::Duration kAxisCall = std::chrono::milliseconds(1500);
inline constexpr base::Duration kLinesCall = std::chrono::milliseconds(1500);
inline constexpr base::Duration kCameraCall = std::chrono::milliseconds(2500);
inline constexpr base::Duration kFrameCall = std::chrono::seconds(10);
inline constexpr base::Duration kLightCall = std::chrono::milliseconds(2500);
/// How long a fault, a limit or a level may take until it shows.
inline constexpr base::Duration kShownWithin = std::chrono::seconds(2);

/// Opens the module's devices at once and holds them until close().
template <typename Kind>
class Opened {
 public:
  Opened(Bench& bench, std::string device) : bench_(bench), name_(std::move(device)) { open(); }

  [[nodiscard]] Kind& device() { return *device_; }
  [[nodiscard]] bool is_open() const { return device_ != nullptr; }

  /// The module's devices end; what is at the other end of the wire goes on.
  void close() {
    device_ = nullptr;
    devices_.clear();
  }

  void open() {
    close();
    devices_ = must(bench_.open(), "opening the module");
    find();
  }

  /// The module opened anew until that succeeds, as rigd is after it was killed: a device may keep to who is
  /// gone for a while.
  void open_after_kill(Waiting& waiting) {
    close();
    base::Result<std::vector<Device>> opened;
    (void)waiting.until(
        [&] {
          opened = bench_.open();
          return opened.has_value();
        },
        kBackWithin, std::chrono::milliseconds(100));
    devices_ = must(std::move(opened), "opening the module after it was killed");
    find();
  }

  /// The module, closed here, doing this in a process of its own.
  [[nodiscard]] std::unique_ptr<Victim> start_victim(decltype(Task::what) what) {
    close();
    auto victim = must(bench_.start_victim({name_, std::move(what)}), "the module in a process of its own");
    if (victim == nullptr) not_proven("this bench's device lives in the module: it would die with it");
    return victim;
  }

 private:
  void find() {
    for (Device& one : devices_) {
      if (one.name != name_) continue;
      auto* found = std::get_if<std::unique_ptr<Kind>>(&one.is);
      require(found != nullptr && *found != nullptr, "the module's device '{}' is of another kind", name_);
      device_ = found->get();
    }
    require(device_ != nullptr, "the module offers no device '{}'", name_);
  }

  Bench& bench_;
  const std::string name_;
  std::vector<Device> devices_;
  Kind* device_ = nullptr;
};

/// How a module ends in the middle of what it does: closed, as when rigd ends in order, or killed with its
/// process.
enum class End { closed, killed };

/// Opens the module and lets go of it, its device absent: a module may refuse to open then, with a reason, or
/// offer one that is lost for now.
inline void require_told_or_lost(Bench& bench) {
  const auto opened = bench.open();
  require(opened || !opened.error().what.empty(), "opening without the device fails without a reason");
}

/// Calls, and fails the check where the call took longer than `bound`, times patience().
template <typename Call>
auto timed(const base::Clock& clock, base::Duration bound, std::string_view what, Call&& call)
    -> decltype(call()) {
  const Stopwatch watch(clock);
  auto answer = call();
  const base::Duration took = watch.elapsed();
  require(took <= patient(bound), "{} took {:.3f} s; a call has to return within {:.3f} s", what,
          base::to_seconds(took), base::to_seconds(patient(bound)));
  return answer;
}

}  // namespace rig::drivers::conformance
