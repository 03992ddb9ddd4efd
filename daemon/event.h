// What can happen to rigd.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "daemon/frame_facts.h"
#include "daemon/state.h"
#include "protocol/rig.pb.h"

namespace rig::daemon {

/// A frame in the pool, handed on by its index.
struct FrameSlot {
  int index = -1;
};

struct Tick {};  ///< a deadline may have passed
struct RequestReceived {
  protocol::ClientId client;
  protocol::Role role = protocol::Role::observer;
  protocol::Request request;
  std::string who = {};  ///< name of the client, as its key or the kernel says
};
struct ClientRevoked {
  std::string who = {};
};
struct AxisPolled {
  std::size_t axis = 0;
  std::uint64_t number = 0;  ///< of the PollAxis it answers
  drivers::AxisState state;
};
/// The driver will not do this jog, now or ever; nothing moved.
struct JogRefused {
  std::size_t axis = 0;
  std::string what;
};
struct LightPolled {
  std::uint64_t number = 0;  ///< of the PollLight it answers
  drivers::LightState state;
};
/// The inputs of one device of lines; nothing of what is not among them.
struct LinesRead {
  std::string device = {};  ///< as machine::lines_name() calls it
  Time asked{};             ///< of the ReadLines it answers
  std::optional<bool> emergency_stop{};
  std::array<std::array<std::optional<bool>, kEnds>, kAxisCount> limits{};
};
/// A device did not do what it was asked.
struct DeviceFailed {
  std::string what;
  std::string device = {};  ///< "axis pan", "camera", "light", machine::lines_name()
  bool transient = false;   ///< it is gone for now and may come back by itself
};
/// The camera did what it was asked by ProbeCamera.
struct CameraAnswered {};
struct CameraTemperatureRead {
  std::optional<double> temperature_c;  ///< nothing: the camera does not tell
};
/// The camera took the trigger: the exposure begins.
struct CameraTriggered {
  std::uint64_t exposure;
};
/// The camera takes no trigger yet: an exposure before goes on.
struct CameraBusy {
  std::uint64_t exposure = 0;  ///< of the TriggerCamera it answers
  std::string what;
};
/// The exposure is over, and its frame arrived damaged or incomplete.
struct FrameDamaged {
  std::uint64_t exposure = 0;  ///< of the FetchFrame it answers
  std::string what;
};
struct FrameNotReady {
  std::uint64_t exposure = 0;  ///< of the FetchFrame it answers
};
struct PreviewPicture {
  int wanted_width = 0;
  Preview picture;
};
struct FrameFetched {
  std::uint64_t exposure = 0;  ///< of the FetchFrame it answers
  FrameSlot slot;
  drivers::FrameInfo info;
  double saturated_share = 0;
  std::shared_ptr<const SampleHistogram> histogram{};  ///< where FetchFrame asked for it
  /// Pictures for those who follow, in the widths that they want; null where nobody does.
  std::shared_ptr<const std::vector<PreviewPicture>> previews = {};
  std::string damage = {};  ///< why the pixels cannot be a frame; empty: they can
};
struct FrameStored {
  std::int64_t row = 0;
  int index = 0;
  std::string sha256;
  std::uint64_t take = 0;  ///< PoseTake::number
};
struct PoseCommitted {
  std::int64_t row = 0;
};
struct JobCreated {
  Asker asker;
  base::Result<JobEntry> entry = JobEntry{};
};
struct JobOpened {
  std::uint64_t id = 0;
  std::shared_ptr<const machine::JobConfig> config;
  std::vector<scan::PlanRow> pending;
  scan::ScanProgress progress;
  scan::VisitsSoFar visits{};
  std::shared_ptr<const PlaceReference> place{};  ///< null: nothing to compare with
  std::string not_checked{};  ///< why the sample's place cannot be checked; empty: it can, or need not be
};
/// What a frame of a visit shows.
struct LookFinding {
  scan::LookRecord record;  ///< of a reference visit
  std::vector<int> tags;    ///< of the others: the ids that are seen
  std::string moved;        ///< of a look at the place: what moved; empty: nothing
};
struct LookJudged {
  std::uint64_t exposure;
  base::Result<LookFinding> finding;
};
/// A reference visit is in the journal.
struct VisitRecorded {
  scan::VisitRecord visit;
  std::vector<std::int64_t> again;     ///< rows that are pending again
  std::vector<scan::PlanRow> pending;  ///< all that are, where `again` is not empty
  scan::ScanProgress progress;
};
/// The job cannot go on: its files are damaged or its disk refuses.
struct StorageFailed {
  std::string what;
  std::uint64_t lost_scan = 0;  ///< the job whose scan folder is no longer there; 0: something else is wrong
  bool disk_refused = false;    ///< the system did not read or write: full, read-only, failing
};
struct DiskRead {
  double free_bytes = 0;     ///< for rigd, where the open scan is
  bool takes_files = false;  ///< that was tried, in the scan and beside rigd's own state
};
/// The watchdog asks whether the loop still decides; the answer is given when step() has seen it.
struct Heartbeat {
  std::function<void()> answer;
};
struct StatisticsDue {};  ///< once a minute of the wall
struct EndRequested {};   ///< SIGTERM

using What =
    std::variant<Tick, RequestReceived, AxisPolled, LightPolled, LinesRead, DeviceFailed, FrameNotReady,
                 FrameFetched, FrameStored, PoseCommitted, JobCreated, JobOpened, StorageFailed, EndRequested,
                 CameraAnswered, CameraTemperatureRead, DiskRead, ClientRevoked, CameraTriggered, LookJudged,
                 VisitRecorded, Heartbeat, StatisticsDue, JogRefused, CameraBusy, FrameDamaged>;

struct Event {
  Time time{};
  What what;
  Time wall = {};  ///< when it happened by the wall's clock
};

}  // namespace rig::daemon
