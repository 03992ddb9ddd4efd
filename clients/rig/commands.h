// What `rig` itself can do.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/base/result.h"

namespace rig::client {

struct Connection {
  std::string endpoint;
  double wait_s = 5;  ///< for rigd to answer, also while it starts
};

using base::Result;

[[nodiscard]] Result<void> status(const Connection& to);
/// No axes: all.
[[nodiscard]] Result<void> home(const Connection& to, const std::vector<std::string>& axes);
[[nodiscard]] Result<void> move(const Connection& to, const std::map<std::string, double>& angles_deg);
/// One axis by so much, homed or not; done when it stands there.
[[nodiscard]] Result<void> jog(const Connection& to, const std::string& axis, double by_deg);
[[nodiscard]] Result<void> stop(const Connection& to, const std::string& reason);
[[nodiscard]] Result<void> clear(const Connection& to);
struct LightChange {
  std::optional<bool> on, shutter_open;
  std::optional<double> level;
};
[[nodiscard]] Result<void> light(const Connection& to, const LightChange& change);
/// Takes one exposure and writes it: .png the preview, .tif the raw samples (16 bits).
[[nodiscard]] Result<void> snap(const Connection& to, double exposure_us, const std::string& out);

[[nodiscard]] Result<void> job_submit(const Connection& to, const std::string& job_file,
                                      const std::string& scan);
[[nodiscard]] Result<void> job_list(const Connection& to);
[[nodiscard]] Result<void> job_show(const Connection& to, std::uint64_t job);
[[nodiscard]] Result<void> job_abort(const Connection& to, std::uint64_t job);
[[nodiscard]] Result<void> job_hold(const Connection& to, std::uint64_t job, const std::string& reason);
[[nodiscard]] Result<void> job_release(const Connection& to, std::uint64_t job);
/// What the job would take; an Error where it cannot be done. An empty scan folder: the disk is not looked
/// at.
[[nodiscard]] Result<void> job_check(const Connection& to, const std::string& job_file,
                                     const std::string& scan);
/// The morning report.
[[nodiscard]] Result<void> job_report(const Connection& to, std::uint64_t job);
/// Before 0: to the end of the queue.
[[nodiscard]] Result<void> job_reorder(const Connection& to, std::uint64_t job, std::uint64_t before);

/// An Error unless the scan is complete and undamaged.
[[nodiscard]] Result<void> scan_verify(const std::string& scan);

}  // namespace rig::client
