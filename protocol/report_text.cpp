#include "protocol/report_text.h"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <google/protobuf/util/json_util.h>

namespace rig::protocol {

namespace {

std::string clock_time(std::int64_t us) {
  const std::time_t seconds = us / 1000000;
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &utc)};
}

std::string duration_text(double seconds) {
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<long>(seconds);
  return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

// Of levels; 0 is none.
struct Range {
  double least = 0, most = 0;
  void add(double level) {
    if (level == 0) return;
    least = least == 0 ? level : std::min(least, level);
    most = std::max(most, level);
  }
};

std::string restarts_text(const Report& report) {
  if (report.restarts_us().empty()) return {};
  std::string times;
  for (const std::int64_t us : report.restarts_us()) times += (times.empty() ? "" : ", ") + clock_time(us);
  return fmt::format("Restarted: rigd was started anew {} {} while the job was under way: {}\n",
                     report.restarts_us_size(), report.restarts_us_size() == 1 ? "time" : "times", times);
}

std::string visits_text(const Report& report) {
  if (report.visits().empty()) return {};
  Range patches;
  Range flat;
  std::string told;
  for (const auto& visit : report.visits()) {
    if (!visit.what().empty())
      told += fmt::format("  {}  visit {}: {}\n", clock_time(visit.time_us()), visit.visit(), visit.what());
    if (!visit.good()) continue;
    patches.add(visit.level());
    flat.add(visit.flat_level());
  }
  std::string out = fmt::format("\nReference: {} visits", report.visits_size());
  if (patches.most > 0)
    out += fmt::format("; the patches between {:.4f} and {:.4f} of the first", patches.least, patches.most);
  if (flat.most > 0) out += fmt::format(", the flat between {:.4f} and {:.4f}", flat.least, flat.most);
  return out + "\n" + told;
}

}  // namespace

std::string report_text(const Report& report) {
  const auto& job = report.job();
  std::string state = JobState_Name(job.state());
  std::transform(state.begin(), state.end(), state.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (job.state() == JOB_FAILED) state = "failed";
  std::string out = fmt::format("Job {} '{}', sample '{}': {}\n", job.job(), job.name(), job.sample(), state);
  if (!job.reason().empty()) out += fmt::format("  {}\n", job.reason());
  for (const auto& on : job.suspensions()) out += fmt::format("  now: {}: {}\n", on.condition(), on.reason());
  out += fmt::format("Scan: {}\n", job.scan_folder());
  std::size_t done = 0;
  std::size_t abandoned = 0;
  std::size_t retried = 0;
  for (const auto& pose : report.poses()) {
    done += pose.state() == "done" ? 1U : 0U;
    abandoned += pose.state() == "abandoned" ? 1U : 0U;
    retried += pose.state() == "done" && pose.failures() > 0 ? 1U : 0U;
  }
  out += fmt::format("Poses: {} planned, {} done ({} of them after retries), {} abandoned, {} pending\n",
                     report.poses_size(), done, retried, abandoned,
                     static_cast<std::size_t>(report.poses_size()) - done - abandoned);
  out += fmt::format("Frames: {}, {:.1f} MB\n", report.frames(),
                     static_cast<double>(report.bytes_used()) * 1e-6);
  if (report.begun_us() != 0) {
    out += fmt::format("Time: {} to {}, {}; {} a pose; suspended for {}\n", clock_time(report.begun_us()),
                       clock_time(report.ended_us()),
                       duration_text(static_cast<double>(report.ended_us() - report.begun_us()) * 1e-6),
                       duration_text(report.seconds_per_pose()), duration_text(report.suspended_s()));
  }
  out += restarts_text(report);
  if (!report.suspensions().empty()) out += "\nSuspensions:\n";
  for (const auto& s : report.suspensions()) {
    out +=
        fmt::format("  {}  {}: {}; {}\n", clock_time(s.since_us()), s.condition(), s.reason(),
                    s.suspended_s() > 0 ? duration_text(s.suspended_s()) : std::string("no end was noted"));
  }
  out += visits_text(report);
  bool any = false;
  for (const auto& pose : report.poses()) {
    if (pose.failures() == 0 && pose.state() != "abandoned") continue;
    if (!any) out += "\nPoses that did not come at the first attempt:\n";
    any = true;
    out += fmt::format("  row {}: {} after {} failed attempts\n", pose.row(), pose.state(), pose.failures());
    for (const auto& reason : pose.reasons()) out += fmt::format("    {}\n", reason);
  }
  return out;
}

base::Result<std::string> report_json(const Report& report) {
  std::string json;
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  const auto status = google::protobuf::util::MessageToJsonString(report, &json, options);
  if (!status.ok()) {
    return base::fail(base::ErrorCode::damaged, fmt::format("the report is no JSON: {}", status.ToString()));
  }
  return json;
}

}  // namespace rig::protocol
