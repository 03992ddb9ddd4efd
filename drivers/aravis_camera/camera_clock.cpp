#include "drivers/aravis_camera/camera_clock.h"

#include <array>

namespace rig::drivers::aravis {

namespace {

struct Names {
  const char* command;
  const char* value;
  const char* counts_per_s;  // nullptr: it counts nanoseconds
};
// SFNC since 2.0, and before.
constexpr std::array<Names, 2> kNames{
    {{"TimestampLatch", "TimestampLatchValue", nullptr},
     {"GevTimestampControlLatch", "GevTimestampValue", "GevTimestampTickFrequency"}}};

bool has(ArvDevice* device, const char* feature) {
  return arv_device_is_feature_available(device, feature, nullptr) != FALSE;
}

}  // namespace

CameraClock::CameraClock(ArvDevice* device, base::Clock& clock) : device_(device), clock_(clock) {
  for (const Names& names : kNames) {
    if (!has(device, names.command) || !has(device, names.value)) continue;
    command_ = names.command;
    value_ = names.value;
    if (names.counts_per_s != nullptr && has(device, names.counts_per_s)) {
      const gint64 told = arv_device_get_integer_feature_value(device, names.counts_per_s, nullptr);
      if (told > 0) counts_per_s_ = static_cast<std::uint64_t>(told);
    }
    return;
  }
}

base::Result<void> CameraClock::latch() {
  if (command_.empty()) return {};
  const base::Time before = clock_.now();
  auto done = attempt("to latch its clock",
                      [&](GError** e) { arv_device_execute_command(device_, command_.c_str(), e); });
  if (!done) return done;
  Failed failed;
  const gint64 counts = arv_device_get_integer_feature_value(device_, value_.c_str(), failed.slot());
  if (failed) return tl::unexpected<base::Error>(failed.as_error("to read its clock"));
  const auto camera = static_cast<base::Duration::rep>(nanoseconds(static_cast<std::uint64_t>(counts)));
  // Whatever was read was so at some time between the two: not every camera holds what it latched.
  const base::Duration half = (clock_.now() - before) / 2;
  // One that took long, as of a camera that is busy, tells less than what was known.
  if (offset_ && half > error()) return {};
  latched_ = before + half;
  error_ = half;
  offset_ = latched_.time_since_epoch() - base::Duration(camera);
  return {};
}

base::Duration CameraClock::error() const {
  constexpr int kDriftShare = 10'000;  // of two quartzes, generously
  return error_ + (clock_.now() - latched_) / kDriftShare;
}

std::optional<base::Time> CameraClock::time_of(std::uint64_t camera_ns) const {
  if (!offset_) return std::nullopt;
  return base::Time(base::Duration(static_cast<base::Duration::rep>(camera_ns)) + *offset_);
}

std::uint64_t CameraClock::nanoseconds(std::uint64_t counts) const {
  constexpr std::uint64_t kNano = 1'000'000'000;
  if (counts_per_s_ == kNano) return counts;
  return counts / counts_per_s_ * kNano + counts % counts_per_s_ * kNano / counts_per_s_;
}

}  // namespace rig::drivers::aravis
