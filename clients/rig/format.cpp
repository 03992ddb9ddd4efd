#include "clients/rig/format.h"

#include <fmt/format.h>

#include "core/base/progress.h"

namespace rig::client {

namespace {

std::string state_word(protocol::JobState state) {
  switch (state) {
    case protocol::QUEUED:
      return "queued";
    case protocol::ACTIVE:
      return "active";
    case protocol::COMPLETE:
      return "complete";
    case protocol::ABORTED:
      return "aborted";
    case protocol::JOB_FAILED:
      return "failed";
    case protocol::HELD:
      return "held";
    case protocol::SUSPENDED:
      return "suspended";
    default:
      return "?";
  }
}

std::string mode_word(protocol::Mode mode) {
  switch (mode) {
    case protocol::IDLE:
      return "idle";
    case protocol::HOMING:
      return "homing";
    case protocol::MOVING:
      return "moving";
    case protocol::EXPOSING:
      return "exposing";
    case protocol::RUNNING:
      return "running a job";
    case protocol::STOPPED:
      return "stopped";
    default:
      return "?";
  }
}

}  // namespace

std::string describe_job_shortly(const protocol::JobInfo& job) {
  std::string out = fmt::format("job {} '{}' ({}): {}, {}/{} poses", job.job(), job.name(), job.sample(),
                                state_word(job.state()), job.done(), job.poses());
  if (job.abandoned() > 0) out += fmt::format(", {} abandoned", job.abandoned());
  if (job.retries() > 0) out += fmt::format(", {} retries", job.retries());
  return out;
}

std::string describe_job(const protocol::JobInfo& job) {
  std::string out = describe_job_shortly(job);
  if (!job.reason().empty()) out += ": " + job.reason();
  if (!job.hold().empty() && job.suspensions().empty()) out += ": " + job.hold();
  for (const auto& suspension : job.suspensions()) {
    out += fmt::format("; {}: {}", suspension.condition(), suspension.reason());
  }
  return out + fmt::format(", {}", job.scan_folder());
}

std::string describe_mode(const protocol::Status& status) {
  std::string out = mode_word(status.mode());
  if (!status.stop_reason().empty()) out += ": " + status.stop_reason();
  return out;
}

std::string describe_light(const protocol::LightStatus& light) {
  std::string out = fmt::format("light {}, level {:.2f}, shutter {}, {}, {:.2f} h", light.on() ? "on" : "off",
                                light.level(), light.shutter_open() ? "open" : "shut",
                                light.warm() ? "warm" : "not warm", light.hours());
  if (!light.fault().empty()) out += ", " + light.fault();
  return out;
}

std::string describe_control(const protocol::Control& control) {
  std::string out = control.holder().empty() ? "control is free"
                                             : fmt::format("control: {}, heard of {:.0f} s ago",
                                                           control.holder(), control.heard_s_ago());
  out += fmt::format(" (free after {:.0f} s of silence)\n", control.release_after_s());
  for (const auto& client : control.clients()) {
    out += fmt::format("  {:20} {:8} {:.0f} s ago{}\n", client.name(), client.role(), client.heard_s_ago(),
                       client.name() == control.you() ? ", you" : "");
  }
  return out;
}

std::string describe_trouble(const protocol::AxisStatus& axis) {
  std::string out;
  if (axis.at_low_limit()) out += ", on its low limit switch";
  if (axis.at_high_limit()) out += ", on its high limit switch";
  if (!axis.fault().empty()) out += ", " + axis.fault();
  return out;
}

std::string describe_status(const protocol::Status& status) {
  std::string out =
      fmt::format("{} (rigd {}): {}\n", status.rig_name(), status.rigd_version(), describe_mode(status));
  for (const auto& axis : status.axes()) {
    out += fmt::format("  {:5} {:10.4f} deg  ({:.1f} to {:.1f})  {}{}{}\n", axis.name(), axis.position_deg(),
                       axis.min_deg(), axis.max_deg(), axis.homed() ? "homed" : "not homed",
                       axis.moving() ? ", moving" : "", describe_trouble(axis));
  }
  out += "  " + describe_light(status.light()) + "\n";
  if (!status.control().holder().empty()) out += "  controlled by " + status.control().holder() + "\n";
  if (status.has_job()) out += "  " + describe_job(status.job()) + "\n";
  return out;
}

std::string describe_suspension(const protocol::Suspension& suspension) {
  std::string out =
      fmt::format("{} for {}", suspension.condition(), base::format_duration(suspension.suspended_s()));
  if (suspension.limit_s() > 0)
    out += fmt::format(" of at most {}", base::format_duration(suspension.limit_s()));
  return out;
}

std::string describe_bytes(double bytes) {
  return bytes >= 1e9 ? fmt::format("{:.1f} GB", bytes * 1e-9) : fmt::format("{:.1f} MB", bytes * 1e-6);
}

std::string describe_preflight(const protocol::Preflight& flight) {
  std::string out = fmt::format("{} poses, at most {} frames and {:.1f} MB\n", flight.poses(),
                                flight.frames(), static_cast<double>(flight.bytes_needed()) * 1e-6);
  out += fmt::format("about {}: travel {}, exposing {}\n", base::format_duration(flight.duration_s()),
                     base::format_duration(flight.travel_s()), base::format_duration(flight.exposing_s()));
  if (flight.bytes_free() > 0) {
    out += fmt::format("{:.1f} MB are free\n", static_cast<double>(flight.bytes_free()) * 1e-6);
  }
  out += fmt::format("the lamp will have burnt {:.1f} h\n", flight.lamp_hours());
  if (flight.visits() > 0) out += fmt::format("{} reference visits\n", flight.visits());
  for (const std::string& warning : flight.warnings()) out += "warning: " + warning + "\n";
  for (const std::string& problem : flight.problems()) out += "problem: " + problem + "\n";
  return out;
}

}  // namespace rig::client
