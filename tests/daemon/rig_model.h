// The devices, the disk and the clients of rigd in memory: they carry out what step() asks for after random
// delays and answer with events, with faults where asked for. Everything that rigd promises is checked at
// every step.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "daemon/frame_pool.h"
#include "daemon/step.h"

namespace rig::daemon::testing {

/// How often what goes wrong, as a probability of each occasion.
struct Faults {
  double lost = 0;        ///< an answer that never comes
  double refused = 0;     ///< a device that fails what it was asked
  double garbage = 0;     ///< a reading that makes no sense
  double off_target = 0;  ///< a move that ends elsewhere
  double stuck = 0;       ///< a move that never ends
  double disk = 0;        ///< the storage fails
  double damaged = 0;     ///< a frame that cannot be one, or that the driver says is damaged
  double busy = 0;        ///< a camera that is not ready for a trigger
  double bad_visit = 0;   ///< a look at reference or place that finds something
  double late_s = 0.002;  ///< the most that anything waits for its turn
};

class RigModel {
 public:
  RigModel(Setup setup, State state, std::uint64_t seed);

  Faults faults;
  bool emergency_stop = false;
  base::Time busy_until{};    ///< the camera
  bool refuses_jogs = false;  ///< drives that cannot move before they are homed
  std::array<bool, kAxisCount> on_low_switch{}, on_high_switch{};
  /// Where the switches stand that are wired to limit lines; an axis that is past one presses it.
  std::array<std::array<double, kEnds>, kAxisCount> line_switch_rad;
  bool lines_silent = false;   ///< no reading of the lines is answered
  std::set<std::string> gone;  ///< "camera", "axis pan", ... do not answer
  /// A fault of the drive, which it keeps until it is enabled.
  std::array<std::string, kAxisCount> latched_fault;
  std::optional<double> camera_temperature_c;
  std::function<void(drivers::LightState&)> on_light_read;  ///< changes what the light says of itself
  double free_bytes = 1e12;                                 ///< of the scan's disk
  bool disk_refuses = false;                                ///< full or read-only
  bool scan_folder_gone = false;
  double patch_dn = 1000, dark_dn = 0;  ///< what a reference visit finds
  std::vector<double> flat_dn = std::vector<double>(16, 2000);
  std::string moved;               ///< what the check of the sample's place finds
  std::vector<int> tags{0, 1, 2};  ///< that are seen

  /// Whatever comes next happens: a device acts, a tick, or the request that a client wants to send by then.
  /// One call of step() at most.
  void advance(base::Time until);
  void request(protocol::Request request, protocol::Role role = protocol::Role::operator_,
               std::string who = "operator");
  void post(What what) { mailbox_.push_back(std::move(what)); }

  [[nodiscard]] double place(std::size_t axis) const;

  void lose_reference(std::size_t axis) { drives_[axis].homed = false; }

  /// A job whose plan is on the disk already.
  void add_job(JobEntry entry, machine::JobConfig config);

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] base::Time now() const { return now_; }
  [[nodiscard]] bool idle() const { return mailbox_.empty() && queue_.empty(); }
  [[nodiscard]] std::size_t steps() const { return steps_; }
  [[nodiscard]] const std::vector<std::string>& broken() const { return broken_; }
  [[nodiscard]] const std::vector<protocol::Reply>& replies() const { return replies_; }
  [[nodiscard]] const std::vector<protocol::Event>& events() const { return events_; }
  [[nodiscard]] const std::vector<Action>& history() const { return history_; }
  [[nodiscard]] const std::set<int>& slots() const { return slots_; }
  [[nodiscard]] std::vector<scan::PlanRow> plan(std::uint64_t job) const { return scans_.at(job).rows; }

  /// What has to be true once nothing is under way any more.
  void check_at_rest();

 private:
  enum Channel { kAxes, kCamera, kLight, kDisk, kChannels };
  struct Drive {
    double from = 0, to = 0;
    base::Time start{}, end{};
    double velocity = 0, acceleration = 0;  // of a trapezoid; 0: steadily from start to end
    bool enabled = false, homed = false, homing = false, stuck = false;
  };
  struct Scan {
    machine::JobConfig config;
    std::vector<scan::PlanRow> rows;
    std::vector<std::int64_t> unproven{};  // committed after the last good visit
    scan::VisitsSoFar visits{};
    bool skipped = false;  // the last visit could not be made
  };
  using Task = std::function<void()>;

  void feed(What what);
  void check(const State& before, const What& what, const Actions& actions);
  void judge(const JudgeLook& look);
  void record(const RecordVisit& action);
  void check_request_books();
  void look_at(const Action& action);
  void carry_out(const Action& action);
  bool to_device(const Action& action);
  bool to_client(const Action& action);
  void on_channel(Channel channel, Task task, int axis = -1);
  void answer(What what);
  bool lost(const std::string& device);
  void drive(std::size_t axis, double to, double seconds);
  void stop_drive(std::size_t axis);
  void read_lines(base::Time asked);
  void expect_lines_allow(std::size_t axis, double way_rad);
  void check_limit_lines(const State& before, const What& what);
  [[nodiscard]] bool has_limit_line(std::size_t axis) const;
  [[nodiscard]] bool moving(std::size_t axis) const;
  void poll(std::size_t axis, std::uint64_t number);
  void fetch(std::uint64_t exposure);
  void to_disk(const Action& action);
  StorageFailed no_room(const std::string& what);
  void check_trigger();
  void check_commit(const CommitPose& commit);
  void replied(const protocol::ClientId& client, std::uint64_t id);
  void release(FrameSlot slot);
  bool chance(double p) { return random_.uniform() < p; }
  void expect(bool holds, const std::string& what);

  Setup setup_;
  State state_;
  base::Random random_;
  base::Time now_{};
  std::size_t steps_ = 0;
  std::deque<What> mailbox_;
  std::multimap<base::Time, Task> queue_;
  std::array<base::Time, kChannels> free_at_{};
  std::array<std::uint64_t, kAxisCount> stops_{};

  std::array<Drive, kAxisCount> drives_;
  std::array<drivers::AxisState, kAxisCount> told_;  // the last reading that step() had
  double level_ = 0;
  bool shutter_ = false;
  base::Time lit_{};
  bool told_emergency_ = false;
  // What step() was told of each limit line last; nothing: not yet, or its device has failed since.
  std::array<std::array<std::optional<bool>, kEnds>, kAxisCount> told_lines_;
  base::Time lines_as_of_{};  // when the newest reading that it was told was asked for
  bool latched_ = false;
  std::optional<std::pair<base::Time, double>> exposing_;
  std::set<int> slots_;
  int next_slot_ = 0;
  std::uint64_t frames_ = 0;

  std::map<std::uint64_t, Scan> scans_;
  std::uint64_t open_scan_ = 0;
  std::map<std::pair<std::int64_t, int>, bool> stored_;  // frames of the open scan, by row and index
  std::int64_t exposed_row_ = -1;                        // whose bracket is neither committed nor discarded
  std::vector<std::uint64_t> completed_;

  std::uint64_t next_request_ = 1;
  std::set<std::uint64_t> open_requests_;
  std::set<std::uint64_t> creating_;
  std::uint64_t last_event_ = 0;
  std::vector<std::string> broken_;
  std::vector<protocol::Reply> replies_;
  std::vector<protocol::Event> events_;
  std::vector<Action> history_;
};

}  // namespace rig::daemon::testing
