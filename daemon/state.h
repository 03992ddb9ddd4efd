// Everything that rigd knows and decides on. A value: step() makes a new one from it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/machine/job_config.h"
#include "core/machine/rig_config.h"
#include "core/scan/journal.h"
#include "daemon/condition_track.h"
#include "daemon/sample_histogram.h"
#include "daemon/visit_standard.h"
#include "drivers/api/device.h"
#include "protocol/server.h"

namespace rig::daemon {

using base::Time;
using machine::JointAngles;
using machine::kAxisCount;
using machine::kEnds;
using machine::kHigh;
using machine::kLow;

struct PlaceReference;

/// What does not change while rigd runs.
struct Setup {
  machine::RigConfig rig;
  drivers::CameraCapabilities camera;
  drivers::LightCapabilities light;
  std::string version;
  std::filesystem::path state_folder{};
  /// As the drivers say; nothing: one cannot.
  std::array<std::optional<double>, kAxisCount> homing_velocity_rad_s{};
};

/// A client's request that is still to be answered.
struct Asker {
  protocol::ClientId client;
  std::uint64_t id = 0;
};

/// What an input said when it was last read.
struct InputTrack {
  bool active = false;
  bool known = false;
  Time as_of{};  ///< it was read then or later
};

/// One axis as last read.
struct AxisTrack {
  drivers::AxisState last;                 ///< its limits are what the drive and the limit lines say together
  std::array<bool, kEnds> drive_limits{};  ///< what the drive alone says
  bool known = false;
  /// Answers to polls up to this one were read before something that changed where the axis stands.
  std::uint64_t outdated = 0;
  double target_rad = 0;
};

/// A movement under way: axes homing one after the other, axes moving together to their targets, or one axis
/// that is not homed moving by a little.
struct Motion {
  enum class Kind { homing, move, jog };
  enum class Leg { detour, target, settle };
  Kind kind = Kind::move;
  Leg leg = Leg::target;
  std::array<bool, kAxisCount> involved{};
  JointAngles target_rad{};
  std::vector<std::size_t> to_home;  ///< the first is homing now
  Time poll_at{};                    ///< when to look next
  Time deadline{};                   ///< a fault after it
  /// Polls whose answers are still to come; 0: none. What an earlier poll says is about before the motion.
  std::array<std::uint64_t, kAxisCount> awaited{};
  Time answer_by{};            ///< a fault if an awaited answer is not there
  std::optional<Asker> asker;  ///< whom to tell; a job's motion has none
  /// Of the leg under way, for its predicted positions: where it began, when, and the last poll before it.
  JointAngles from_rad{};
  Time sent{};
  std::uint64_t sent_after_poll = 0;
  Time began{};
  std::optional<Time> lines_at{};  ///< when its limit lines are read next, or must have been; nothing: none
};

/// One pose of the plan being taken: moved to, exposed, stored.
struct PoseTake {
  std::uint64_t number = 0;  ///< of this take: what is told of an earlier one of the row is outdated
  std::int64_t row = 0;
  int attempt = 1;
  JointAngles target_rad{};
  JointAngles readback_rad{};
  Time arrived{};
  std::vector<scan::FrameRecord> frames;  ///< those fetched; stored where sha256 is not empty
  std::vector<std::shared_ptr<const SampleHistogram>> histograms;  ///< of `frames`; null where not needed
  std::optional<double> short_share;  ///< of an adaptive bracket: pixels that miss the ratio asked for
  std::size_t triggered = 0;
  bool complete = false;          ///< no further exposure follows
  std::uint64_t light_asked = 0;  ///< the look at the light after the last frame; 0: not yet
  bool committing = false;
  std::vector<scan::EventRecord> events;  ///< told of this take so far; they go into the journal with it
};

/// The exposure that the camera is making or reading out.
struct PendingFrame {
  std::uint64_t exposure = 0;  ///< its number; frames of an earlier one that was stopped may still come
  std::int64_t row = -1;       ///< of the plan, or kSnapRow, kVisitRow
  int index = 0;
  double exposure_s = 0;
  std::optional<Time> again{};  ///< the camera was busy: it is to be triggered again then
  Time busy_until{};            ///< a fault if it still is
  bool exposing = false;        ///< the camera took the trigger; the times below are known
  Time exposed{};               ///< end of the exposure
  Time fetch_at{};
  Time deadline{};
  bool fetching = false;
  Time answer_by{};  ///< of the trigger, then of the fetch
};

/// PendingFrame::row of what is no pose's frame.
inline constexpr std::int64_t kSnapRow = -1;
inline constexpr std::int64_t kVisitRow = -2;

/// What a job looks at beside its poses, being made (visit.h).
struct Visit {
  enum class Kind {
    place,      ///< do the fiducials stand where they stood?
    identity,   ///< is it the sample that the job is for?
    reference,  ///< dark frame and reference patches
  };
  enum class Stage { to_move, moving, to_light, lighting, to_expose, exposing, judging };
  Kind kind = Kind::reference;
  Stage stage = Stage::to_move;
  std::size_t look = 0;  ///< which of its frames
  int attempts = 0;      ///< that failed
  std::uint64_t exposure = 0;
  std::uint64_t light_asked = 0;  ///< the poll after the shutter was set
  std::vector<scan::LookRecord> looks;
};

/// A reference visit failed; until `again` the job is suspended.
struct BadVisit {
  bool room_dark = true;
  std::string what;
  Time again{};
};

struct JobEntry {
  enum class State { queued, active, complete, aborted, failed };
  std::uint64_t id = 0;
  std::string name, sample, scan_folder;
  State state = State::queued;
  std::int64_t poses = 0, done = 0, abandoned = 0, retries = 0;
  std::string reason;
  std::string hold;                  ///< why it is held until an operator releases it; empty: it is not
  bool hold_told = false;            ///< somebody knows of it; not remembered
  bool needs_sample_change = false;  ///< a person has not yet changed the sample for it
};

/// The job that is being carried out. Its plan stays in the journal; here are the rows that are still to be
/// taken.
struct ActiveJob {
  enum class Phase { opening, homing, warming, running };
  std::uint64_t id = 0;
  Phase phase = Phase::opening;
  std::shared_ptr<const machine::JobConfig> config;
  std::deque<scan::PlanRow> rows;   ///< in the order in which they are taken
  std::optional<PoseTake> current;  ///< moving or exposing
  std::optional<PoseTake> storing;  ///< exposed, not yet committed
  Time not_before{};                ///< the next pose waits until then: a retry's delay
  std::uint64_t light_asked = 0;    ///< the poll that came after the light was set up for the job
  bool lamp_asked = false;          ///< to burn, for this job; not yet where it has to cool down
  double seconds_per_pose = 0;      ///< smoothed, rig time
  Time last_commit{};
  Time warming_since{};  ///< in the phase warming
  scan::VisitsSoFar visits;
  std::shared_ptr<const PlaceReference> place;  ///< to be compared with before a pose begins; null: nothing
  bool identity_due = false;
  bool reference_due = false;
  bool last_visit_skipped = false;  ///< the rig cannot go there from where the job ends
  std::int64_t visit_after = 0;     ///< a visit is put off until so many poses are committed in this opening
  std::int64_t committed = 0;       ///< poses, since the job was opened
  std::optional<Visit> visit;
  std::optional<VisitOutcome> recording;  ///< of one on its way into the journal; the next waits for that
  std::optional<Rival> rival;
  std::optional<BadVisit> bad_visit;
  int bad_visits = 0;      ///< one after the other
  bool suspended = false;  ///< a condition is on: no pose begins
  bool resting = false;    ///< suspended, and nothing of the job is under way: the rig may be used by hand
};

struct Snap {
  Asker asker;
  bool full = false;
  int preview_width = protocol::PreviewWish{}.width;
};

/// Who was heard of, in wall time.
struct Presence {
  protocol::Role role = protocol::Role::observer;
  Time heard{};
};

/// Control of the rig: one client has it or nobody (lease.h).
struct Lease {
  std::string holder;  ///< empty: free
  std::map<std::string, Presence> present;
};

struct State {
  Time now{};
  Time wall{};  ///< what leases are measured in, also where `now` is a simulated clock's
  std::uint64_t epoch = 1;
  std::uint64_t last_event = 0;
  std::uint64_t last_poll = 0;      ///< number of the latest PollAxis or PollLight
  std::uint64_t last_exposure = 0;  ///< number of the latest exposure
  std::array<AxisTrack, kAxisCount> axes;
  drivers::LightState light;
  bool light_known = false;
  std::optional<Time> lamp_out_since;  ///< as far as is known
  std::uint64_t light_read = 0;        ///< number of the poll that told
  bool emergency_stop = false;
  /// Of each axis and end; those that rig.toml does not name are never known.
  std::array<std::array<InputTrack, kEnds>, kAxisCount> limit_lines;
  Time lines_asked{};      ///< when the latest ReadLines was given
  std::string stopped;     ///< why the stop is latched; empty: it is not
  std::string last_alarm;  ///< since the stop was latched
  bool ending = false;     ///< asked to end; nothing new begins

  std::optional<Motion> motion;
  std::optional<PendingFrame> frame;
  std::optional<std::uint64_t> last_frame;  ///< the camera's own number of the frame that came last
  int frames_refused = 0;                   ///< one after the other
  Time camera_free{};  ///< when the latest exposure, aborted or not, and its readout must be over
  std::optional<Snap> snap;
  std::vector<JobEntry> jobs;
  std::optional<ActiveJob> job;
  std::uint64_t last_take = 0;  ///< number of the latest PoseTake
  bool parking = false;         ///< the axes are to go to the park pose once they stand

  std::array<ConditionTrack, kConditionCount> conditions;  ///< of the active job, by Condition
  std::map<std::string, std::string> lost;  ///< devices that do not answer for now, and what was said
  std::optional<double> free_bytes;         ///< where the active job's scan is, as last told
  std::optional<std::string> disk_refuses;  ///< why it took no file; nothing: it takes them
  int disk_failures = 0;                    ///< such, without a pose committed between
  Time disk_look_at{};
  Time camera_look_at{};
  std::optional<double> camera_temperature_c;

  Lease lease;

  Time look_at{};  ///< next regular look at lines, light and axes
};

}  // namespace rig::daemon
