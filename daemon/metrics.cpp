#include "daemon/metrics.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <unistd.h>

#include "daemon/messages.h"

namespace rig::daemon {

namespace {

// Collects metrics of one message.
struct Sheet {
  protocol::Metrics metrics;

  void put(const char* name, double value, bool counter, const char* help, const std::string& bus = {}) {
    auto& metric = *metrics.add_metrics();
    metric.set_name(name);
    metric.set_value(value);
    metric.set_counter(counter);
    metric.set_help(help);
    metric.set_bus(bus);
  }
  void gauge(const char* name, double value, const char* help, const std::string& bus = {}) {
    put(name, value, false, help, bus);
  }
  void counter(const char* name, double value, const char* help, const std::string& bus = {}) {
    put(name, value, true, help, bus);
  }
};

// Resident memory; 0 where the system does not tell.
double memory_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0;
  double resident = 0;
  if (!(statm >> total >> resident)) return 0;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

const JobEntry* running_job(const State& state) {
  if (!state.job) return nullptr;
  const auto found = std::find_if(state.jobs.begin(), state.jobs.end(),
                                  [&](const JobEntry& job) { return job.id == state.job->id; });
  return found == state.jobs.end() ? nullptr : &*found;
}

double disk_free_bytes(const std::filesystem::path& folder) {
  std::error_code unknown_is_zero;
  const auto space = std::filesystem::space(folder, unknown_is_zero);
  return unknown_is_zero ? 0 : static_cast<double>(space.available);
}

std::vector<std::string> buses_of(const protocol::Metrics& metrics) {
  std::vector<std::string> buses;
  for (const auto& metric : metrics.metrics()) {
    if (!metric.bus().empty() && std::find(buses.begin(), buses.end(), metric.bus()) == buses.end())
      buses.push_back(metric.bus());
  }
  return buses;
}

}  // namespace

void Counters::count(const protocol::Event& event) {
  if (event.has_pose_committed()) ++poses;
  if (event.has_frame_taken()) ++frames;
  if (event.has_pose_failed()) {
    ++failures;
    if (event.pose_failed().abandoned()) ++abandoned;
  }
  if (event.has_stop_latched()) ++stops;
  if (event.has_alarm()) ++alarms;
}

protocol::Metrics gather_metrics(const MetricSources& from) {
  Sheet sheet;
  const std::chrono::duration<double> up = std::chrono::steady_clock::now() - from.started;
  sheet.gauge("rig_up_seconds", up.count(), "Since rigd started.");
  sheet.gauge("rig_stopped", from.state.stopped.empty() ? 0 : 1, "1 while a stop is latched.");
  const JobEntry* job = running_job(from.state);
  sheet.gauge("rig_job", job != nullptr ? static_cast<double>(job->id) : 0, "Running job; 0: none.");
  sheet.gauge("rig_job_poses", job != nullptr ? static_cast<double>(job->poses) : 0, "Poses of that job.");
  sheet.gauge("rig_job_poses_done", job != nullptr ? static_cast<double>(job->done) : 0,
              "Poses of that job on the disk.");
  const Counters& counted = from.counters;
  sheet.counter("rig_poses_committed_total", static_cast<double>(counted.poses),
                "Poses written and journalled.");
  sheet.counter("rig_frames_total", static_cast<double>(counted.frames), "Frames taken for jobs.");
  sheet.counter("rig_pose_failures_total", static_cast<double>(counted.failures),
                "Attempts at a pose that failed.");
  sheet.counter("rig_poses_abandoned_total", static_cast<double>(counted.abandoned), "Poses given up.");
  sheet.counter("rig_stops_total", static_cast<double>(counted.stops), "Stops that were latched.");
  sheet.counter("rig_alarms_total", static_cast<double>(counted.alarms), "Failures while stopped.");
  sheet.gauge("rig_frame_slots", static_cast<double>(from.pool.slots()), "Frames that memory holds.");
  sheet.gauge("rig_frame_slots_free", static_cast<double>(from.pool.free_slots()), "Those not in use.");
  sheet.gauge("rig_loop_waiting", static_cast<double>(from.events_waiting),
              "Events the loop has not seen yet.");
  sheet.gauge("rig_storage_waiting", static_cast<double>(from.storage.waiting()),
              "Actions that wait for the disk.");
  const auto store = from.storage.timings().summary();
  sheet.counter("rig_stores_total", static_cast<double>(store.count), "Frames written.");
  sheet.counter("rig_store_seconds_total", store.total_s, "Time that took.");
  sheet.gauge("rig_store_seconds_worst", store.worst_s, "The slowest since the last Stats line.");
  for (const auto& [bus, worker] : from.devices.workers) {
    const auto took = worker->timings().summary();
    sheet.gauge("rig_bus_waiting", static_cast<double>(worker->waiting()), "Transactions that wait.", bus);
    sheet.counter("rig_bus_transactions_total", static_cast<double>(took.count), "Transactions done.", bus);
    sheet.counter("rig_bus_seconds_total", took.total_s, "Time they took.", bus);
    sheet.gauge("rig_bus_seconds_worst", took.worst_s, "The slowest since the last Stats line.", bus);
  }
  sheet.gauge("rig_disk_free_bytes",
              disk_free_bytes(job != nullptr ? std::filesystem::path(job->scan_folder) : from.state_folder),
              "On the disk of the running scan, else of rigd's state.");
  sheet.gauge("rig_memory_bytes", memory_bytes(), "Resident memory of rigd.");
  sheet.gauge("rig_clients", static_cast<double>(from.server.client_count()),
              "Clients that follow the events.");
  sheet.counter("rig_previews_dropped_total", static_cast<double>(from.server.previews_dropped()),
                "Previews that slow clients missed.");
  return sheet.metrics;
}

double value_of(const protocol::Metrics& metrics, const std::string& name, const std::string& bus) {
  for (const auto& metric : metrics.metrics()) {
    if (metric.name() == name && metric.bus() == bus) return metric.value();
  }
  return 0;
}

std::string statistics_line(const protocol::Metrics& now, const protocol::Metrics& before) {
  const auto value = [&](const char* name, const std::string& bus = {}) { return value_of(now, name, bus); };
  const auto grown = [&](const char* name, const std::string& bus = {}) {
    return value(name, bus) - value_of(before, name, bus);
  };
  const auto count = [&](const char* name) {
    return fmt::format("{:.0f} (+{:.0f})", value(name), grown(name));
  };
  const auto mean_ms = [&](const char* seconds, const char* times, const std::string& bus = {}) {
    return grown(times, bus) > 0 ? 1e3 * grown(seconds, bus) / grown(times, bus) : 0.0;
  };
  std::string line = fmt::format(
      "Stats: job {:.0f} {:.0f}/{:.0f}, poses {}, frames {}, retries {}, abandoned {}", value("rig_job"),
      value("rig_job_poses_done"), value("rig_job_poses"), count("rig_poses_committed_total"),
      count("rig_frames_total"), count("rig_pose_failures_total"), count("rig_poses_abandoned_total"));
  line += fmt::format(", stopped {:.0f}, waiting loop {:.0f} storage {:.0f}, free slots {:.0f}/{:.0f}",
                      value("rig_stopped"), value("rig_loop_waiting"), value("rig_storage_waiting"),
                      value("rig_frame_slots_free"), value("rig_frame_slots"));
  line +=
      fmt::format(", store {:.1f} ms worst {:.1f}", mean_ms("rig_store_seconds_total", "rig_stores_total"),
                  1e3 * value("rig_store_seconds_worst"));
  for (const std::string& bus : buses_of(now)) {
    line += fmt::format(", bus {} {:.2f} ms worst {:.1f} waiting {:.0f}", bus,
                        mean_ms("rig_bus_seconds_total", "rig_bus_transactions_total", bus),
                        1e3 * value("rig_bus_seconds_worst", bus), value("rig_bus_waiting", bus));
  }
  return line + fmt::format(", disk free {:.1f} GB, memory {:.0f} MB, clients {:.0f}, dropped previews {}",
                            1e-9 * value("rig_disk_free_bytes"), 1e-6 * value("rig_memory_bytes"),
                            value("rig_clients"), count("rig_previews_dropped_total"));
}

std::vector<base::LogField> statistics_fields(const protocol::Metrics& metrics) {
  std::vector<base::LogField> fields;
  for (const auto& metric : metrics.metrics()) {
    std::string name = metric.name() + (metric.bus().empty() ? "" : "_" + metric.bus());
    for (char& c : name) {
      c = std::isalnum(static_cast<unsigned char>(c)) != 0
              ? static_cast<char>(std::toupper(static_cast<unsigned char>(c)))
              : '_';
    }
    fields.push_back({std::move(name), fmt::format("{}", metric.value())});
  }
  return fields;
}

std::string status_line(const State& state) {
  if (!state.stopped.empty()) return "stopped: " + state.stopped;
  if (const JobEntry* job = running_job(state)) {
    return fmt::format("job {} '{}': {} of {} poses done, {} abandoned", job->id, job->name, job->done,
                       job->poses, job->abandoned);
  }
  const auto waiting = std::count_if(state.jobs.begin(), state.jobs.end(), [](const JobEntry& job) {
    return job.state == JobEntry::State::queued;
  });
  return waiting == 0 ? std::string("no job") : fmt::format("{} jobs queued", waiting);
}

}  // namespace rig::daemon
