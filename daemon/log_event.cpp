#include "daemon/log_event.h"

#include <vector>

#include "core/base/log.h"

namespace rig::daemon {

using base::LogField;
using base::LogLevel;

namespace {

void log(LogLevel level, const std::string& message, const char* event, std::vector<LogField> fields) {
  fields.insert(fields.begin(), {"RIG_EVENT", event});
  base::log_line(level, message, fields);
}

void log_job(const protocol::JobInfo& job) {
  const LogField number{"RIG_JOB", std::to_string(job.job())};
  switch (job.state()) {
    case protocol::COMPLETE:
      return log(LogLevel::info,
                 fmt::format("job {} is complete: {} of {} poses done, {} abandoned", job.job(), job.done(),
                             job.poses(), job.abandoned()),
                 "job_complete", {number});
    case protocol::ABORTED:
    case protocol::JOB_FAILED:
      return log(LogLevel::warning, fmt::format("job {} ended: {}", job.job(), job.reason()), "job_ended",
                 {number, {"RIG_REASON", job.reason()}});
    default:
      return;
  }
}

}  // namespace

void log_event(const protocol::Event& event) {
  if (event.has_stop_latched()) {
    const std::string& reason = event.stop_latched().reason();
    log(LogLevel::warning, "stopped: " + reason, "stop_latched", {{"RIG_REASON", reason}});
  } else if (event.has_stop_cleared()) {
    log(LogLevel::info, "the stop was cleared", "stop_cleared", {});
  } else if (event.has_alarm()) {
    log(LogLevel::error, event.alarm().text(), "alarm", {{"RIG_REASON", event.alarm().text()}});
  } else if (event.has_pose_failed()) {
    const auto& pose = event.pose_failed();
    log(LogLevel::warning,
        fmt::format("row {}: {}{}", pose.row(), pose.reason(), pose.abandoned() ? "; abandoned" : ""),
        "pose_failed",
        {{"RIG_JOB", std::to_string(pose.job())},
         {"RIG_ROW", std::to_string(pose.row())},
         {"RIG_ATTEMPT", std::to_string(pose.attempt())},
         {"RIG_REASON", pose.reason()}});
  } else if (event.has_control_changed()) {
    const auto& control = event.control_changed();
    log(LogLevel::info,
        fmt::format("control: '{}', before '{}': {}", control.holder(), control.previous(), control.reason()),
        "control_changed", {{"RIG_CLIENT", control.holder()}, {"RIG_REASON", control.reason()}});
  } else if (event.has_job_suspended()) {
    const auto& suspended = event.job_suspended();
    log(LogLevel::warning,
        fmt::format("job {} is suspended, {}: {}", suspended.job(), suspended.condition(),
                    suspended.reason()),
        "job_suspended",
        {{"RIG_JOB", std::to_string(suspended.job())},
         {"RIG_CONDITION", suspended.condition()},
         {"RIG_REASON", suspended.reason()}});
  } else if (event.has_job_released()) {
    const auto& released = event.job_released();
    log(LogLevel::info, fmt::format("job {}: {} has ended", released.job(), released.condition()),
        "job_released",
        {{"RIG_JOB", std::to_string(released.job())}, {"RIG_CONDITION", released.condition()}});
  } else if (event.has_job_changed()) {
    log_job(event.job_changed().job());
  }
}

}  // namespace rig::daemon
