// The numbers that explain a night afterwards: for a client, and as one line of the log.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/log.h"
#include "daemon/devices.h"
#include "daemon/frame_pool.h"
#include "daemon/state.h"
#include "daemon/storage.h"
#include "protocol/server.h"

namespace rig::daemon {

/// What was published since the start.
struct Counters {
  std::uint64_t poses = 0, frames = 0, failures = 0, abandoned = 0, stops = 0, alarms = 0;

  void count(const protocol::Event& event);
};

/// Where the numbers come from.
struct MetricSources {
  const State& state;
  const Counters& counters;
  const OpenDevices& devices;
  const FramePool& pool;
  Storage& storage;
  const protocol::Server& server;
  std::size_t events_waiting;
  std::chrono::steady_clock::time_point started;
  std::filesystem::path state_folder;  ///< whose disk counts while no job runs
};

[[nodiscard]] protocol::Metrics gather_metrics(const MetricSources& from);

/// A metric's value; 0 where there is none of that name and bus.
[[nodiscard]] double value_of(const protocol::Metrics& metrics, const std::string& name,
                              const std::string& bus = {});

/// "Stats: poses 120 (+8), ...". What grows is followed by how much it grew since `before`, and times are
/// means since then.
[[nodiscard]] std::string statistics_line(const protocol::Metrics& now, const protocol::Metrics& before);
/// The same numbers for the journal: RIG_FRAMES_TOTAL=360, with the bus behind it where there is one.
[[nodiscard]] std::vector<base::LogField> statistics_fields(const protocol::Metrics& metrics);

/// One line for `systemctl status`.
[[nodiscard]] std::string status_line(const State& state);

}  // namespace rig::daemon
