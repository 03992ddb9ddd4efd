#include "tests/daemon/rig_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/units.h"
#include "core/machine/limits.h"
#include "core/machine/motion.h"
#include "daemon/place.h"

namespace rig::daemon::testing {

using base::seconds;

namespace {

constexpr std::size_t kSlots = 3;

bool energises(const Action& action) {
  if (const auto* level = std::get_if<SetLightLevel>(&action)) return level->level > 0;
  if (const auto* shutter = std::get_if<SetShutter>(&action)) return shutter->open;
  return std::holds_alternative<EnableAxis>(action) || std::holds_alternative<HomeAxis>(action) ||
         std::holds_alternative<MoveAxis>(action) || std::holds_alternative<JogAxis>(action) ||
         std::holds_alternative<ArmCamera>(action) || std::holds_alternative<TriggerCamera>(action);
}

}  // namespace

RigModel::RigModel(Setup setup, State state, std::uint64_t seed)
    : setup_(std::move(setup)), state_(std::move(state)), random_(seed), now_(state_.now) {
  latched_ = !state_.stopped.empty();
  told_emergency_ = state_.emergency_stop;
  last_event_ = state_.last_event;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const drivers::AxisState& last = state_.axes[i].last;
    drives_[i].from = drives_[i].to = last.position_rad;
    drives_[i].homed = last.homed;
    drives_[i].enabled = last.enabled;
    told_[i] = last;
    constexpr double kNowhere_rad = 1e9;
    line_switch_rad[i] = {-kNowhere_rad, kNowhere_rad};
  }
}

void RigModel::add_job(JobEntry entry, machine::JobConfig config) {
  Scan scan{std::move(config), {}};
  for (std::size_t i = 0; i < scan.config.poses.size(); ++i) {
    scan.rows.push_back({static_cast<std::int64_t>(i), scan.config.poses[i], scan::RowState::pending, 0, {}});
  }
  entry.poses = static_cast<std::int64_t>(scan.rows.size());
  scans_[entry.id] = std::move(scan);
  state_.jobs.push_back(std::move(entry));
}

void RigModel::expect(bool holds, const std::string& what) {
  if (!holds) broken_.push_back("step " + std::to_string(steps_) + ": " + what);
}

void RigModel::request(protocol::Request request, protocol::Role role, std::string who) {
  request.set_version(1);
  request.set_id(next_request_++);
  mailbox_.push_back(RequestReceived{{1, "c"}, role, std::move(request), std::move(who)});
}

void RigModel::advance(base::Time until) {
  if (!mailbox_.empty()) {
    What what = std::move(mailbox_.front());
    mailbox_.pop_front();
    feed(std::move(what));
    return;
  }
  base::Time next = until;
  if (!queue_.empty()) next = std::min(next, queue_.begin()->first);
  const auto wake = next_wake(state_);
  if (wake && wake->at <= next) {
    now_ = std::max(now_, wake->at);
    feed(Tick{});
    return;
  }
  now_ = std::max(now_, next);
  if (queue_.empty() || queue_.begin()->first > now_) return;
  const Task task = queue_.begin()->second;
  queue_.erase(queue_.begin());
  task();
}

void RigModel::feed(What what) {
  ++steps_;
  if (const auto* received = std::get_if<RequestReceived>(&what))
    open_requests_.insert(received->request.id());
  if (const auto* polled = std::get_if<AxisPolled>(&what)) told_[polled->axis] = polled->state;
  if (const auto* read = std::get_if<LinesRead>(&what)) {
    told_emergency_ = read->emergency_stop.value_or(told_emergency_);
    told_lines_ = read->limits;
    lines_as_of_ = std::max(lines_as_of_, read->asked);
  }
  if (const auto* failed = std::get_if<DeviceFailed>(&what)) {
    if (failed->device == "lines") told_lines_ = {};
  }
  if (const auto* committed = std::get_if<PoseCommitted>(&what)) {
    if (exposed_row_ == committed->row) exposed_row_ = -1;
  }
  const State before = state_;
  Step next = step(setup_, std::move(state_), Event{now_, what, now_});
  state_ = std::move(next.state);
  check(before, what, next.actions);
  check_limit_lines(before, what);
  for (const Action& action : next.actions) {
    look_at(action);
    carry_out(action);
    history_.push_back(action);
  }
  check_request_books();
}

// A stop is a stop of everything, whatever it was for.
void RigModel::check(const State& before, const What& what, const Actions& actions) {
  bool stops = before.stopped.empty() && !state_.stopped.empty();
  if (const auto* received = std::get_if<RequestReceived>(&what)) stops |= received->request.has_stop();
  if (!stops) return;
  std::set<std::size_t> axes;
  bool dark = false;
  for (const Action& action : actions) {
    if (const auto* stop = std::get_if<StopAxis>(&action)) axes.insert(stop->axis);
    if (const auto* shutter = std::get_if<SetShutter>(&action)) dark |= !shutter->open;
    if (const auto* level = std::get_if<SetLightLevel>(&action)) dark |= level->level == 0;
  }
  expect(axes.size() == kAxisCount, "a stop did not stop every axis");
  expect(dark, "a stop left the light as it was");
  expect(!state_.motion && !state_.frame && !state_.snap && !state_.job, "a stop left something under way");
}

bool RigModel::has_limit_line(std::size_t axis) const {
  const machine::LimitLines& lines = setup_.rig.lines.limit[axis];
  return lines[kLow] || lines[kHigh];
}

// An axis that runs into the switch of a limit line is stopped when that is read, and never moves for longer
// than lines_ms without a reading.
void RigModel::check_limit_lines(const State& before, const What& what) {
  const auto& motion = state_.motion;
  for (std::size_t i = 0; i < kAxisCount && motion && motion->kind != Motion::Kind::homing; ++i) {
    if (!motion->involved[i] || !has_limit_line(i)) continue;
    const double unread_s = base::to_seconds(now_ - std::max(lines_as_of_, motion->began));
    expect(unread_s < setup_.rig.deadlines.lines_s + 1e-6, "an axis moves and its limit lines are not read");
    if (!std::holds_alternative<LinesRead>(what) || !before.motion) continue;
    const double way = state_.axes[i].target_rad - motion->from_rad[i];
    const double tolerance_rad = setup_.rig.axes[i].tolerance_rad;
    expect(!(told_lines_[i][kLow].value_or(false) && way < -tolerance_rad) &&
               !(told_lines_[i][kHigh].value_or(false) && way > tolerance_rad),
           "an axis that ran into the switch of a limit line moves on");
  }
}

void RigModel::read_lines(base::Time asked) {
  if (lines_silent || lost("lines") || chance(faults.lost)) return;
  if (chance(faults.refused)) return answer(DeviceFailed{"lines: no answer", "lines"});
  LinesRead read{"lines", asked, emergency_stop, {}};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (setup_.rig.lines.limit[i][kLow]) read.limits[i][kLow] = place(i) <= line_switch_rad[i][kLow];
    if (setup_.rig.lines.limit[i][kHigh]) read.limits[i][kHigh] = place(i) >= line_switch_rad[i][kHigh];
  }
  answer(std::move(read));
}

void RigModel::check_request_books() {
  std::set<std::uint64_t> waiting = creating_;
  if (state_.motion && state_.motion->asker) waiting.insert(state_.motion->asker->id);
  if (state_.snap) waiting.insert(state_.snap->asker.id);
  expect(waiting == open_requests_, "a request is neither answered nor under way");
  open_requests_ = waiting;
}

// Unknown is not free, and a switch that is pressed lets an axis out only.
void RigModel::expect_lines_allow(std::size_t axis, double way_rad) {
  const double tolerance_rad = setup_.rig.axes[axis].tolerance_rad;
  for (std::size_t end = 0; end < kEnds; ++end) {
    if (!setup_.rig.lines.limit[axis][end]) continue;
    const auto& told = told_lines_[axis][end];
    expect(told.has_value(), "a move while what a limit line says is not known");
    const double further_in = end == kLow ? -way_rad : way_rad;
    expect(!told.value_or(false) || further_in <= tolerance_rad, "a move further into a limit line's switch");
  }
}

// What an action must not be, whatever led to it.
void RigModel::look_at(const Action& action) {
  if (energises(action)) {
    expect(!latched_, "something begins while the stop is latched");
    expect(!told_emergency_, "something begins while the emergency stop is active");
  }
  if (std::holds_alternative<SetShutter>(action)) {
    expect(setup_.light.has_shutter, "a shutter that is not there");
  }
  if (const auto* move = std::get_if<MoveAxis>(&action)) {
    const machine::AxisConfig& axis = setup_.rig.axes[move->axis];
    expect(move->target_rad >= axis.min_rad && move->target_rad <= axis.max_rad, "a move out of the limits");
    expect(move->velocity_rad_s <= axis.max_velocity_rad_s, "a move that is too fast");
    expect(move->acceleration_rad_s2 <= axis.max_acceleration_rad_s2, "a move that accelerates too fast");
    JointAngles there{};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      expect(told_[i].homed && std::isfinite(told_[i].position_rad), "a move while an axis is not homed");
      expect(told_[i].fault.empty(), "a move while an axis has a fault");
      const bool goes = state_.motion && state_.motion->involved[i];
      there[i] = goes ? state_.axes[i].target_rad : told_[i].position_rad;
      expect_lines_allow(i, goes ? there[i] - told_[i].position_rad : 0);
    }
    expect(machine::check_standing(setup_.rig, there).has_value(), "a move into a keep-out zone");
  }
  if (const auto* jog = std::get_if<JogAxis>(&action)) {
    const machine::AxisConfig& axis = setup_.rig.axes[jog->axis];
    const drivers::AxisState& here = told_[jog->axis];
    expect(std::abs(jog->by_rad) <= base::radians(10) + 1e-12, "a jog that goes far");
    expect(jog->velocity_rad_s <= axis.jog_velocity_rad_s, "a jog faster than the reduced speed");
    expect(jog->acceleration_rad_s2 <= axis.max_acceleration_rad_s2, "a jog that accelerates too fast");
    expect(!here.homed, "a jog of an axis that knows its limits");
    expect(here.fault.empty() && !here.moving, "a jog of an axis that moves or has a fault");
    expect(!(here.at_low_limit && jog->by_rad < 0) && !(here.at_high_limit && jog->by_rad > 0),
           "a jog further into a limit switch");
    for (std::size_t i = 0; i < kAxisCount; ++i) expect_lines_allow(i, i == jog->axis ? jog->by_rad : 0);
  }
  if (const auto* publish = std::get_if<Publish>(&action)) {
    expect(publish->event.number() == last_event_ + 1, "event numbers have a gap");
    last_event_ = publish->event.number();
    if (publish->event.has_alarm() &&
        publish->event.alarm().text().starts_with("the last poses are not proven"))
      scans_.at(open_scan_).skipped = true;
    if (publish->event.has_stop_latched()) latched_ = true;
    if (publish->event.has_stop_cleared()) latched_ = false;
    if (publish->event.has_job_changed()) {
      const auto& job = publish->event.job_changed().job();
      if (job.state() == protocol::COMPLETE) {
        expect(job.done() + job.abandoned() == job.poses(), "a job is complete without all of its poses");
        const Scan& scan = scans_.at(job.job());
        expect(!setup_.rig.unattended.reference || scan.unproven.empty() || scan.skipped,
               "a job is complete with poses that no good visit followed");
        completed_.push_back(job.job());
      }
    }
    events_.push_back(publish->event);
  }
}

void RigModel::on_channel(Channel channel, Task task, int axis) {
  const base::Time at = std::max(free_at_[channel], now_ + seconds(random_.uniform(0, faults.late_s)));
  free_at_[channel] = at;
  if (axis < 0) {
    queue_.emplace(at, std::move(task));
    return;
  }
  // A stop drops what is queued for its axis: BusWorker sees to that.
  const auto i = static_cast<std::size_t>(axis);
  queue_.emplace(at, [this, i, stops = stops_[i], task = std::move(task)] {
    if (stops_[i] != stops) return;
    if (lost(fmt::format("axis {}", machine::kAxisNames[i]))) return;
    if (chance(faults.refused)) {
      answer(DeviceFailed{"an axis refuses"});
    } else {
      task();
    }
  });
}

// Says so, as its driver would.
bool RigModel::lost(const std::string& device) {
  if (gone.count(device) == 0) return false;
  answer(DeviceFailed{device + ": unplugged", device, true});
  return true;
}

void RigModel::answer(What what) {
  mailbox_.push_back(std::move(what));
}

double RigModel::place(std::size_t axis) const {
  const Drive& d = drives_[axis];
  if (now_ >= d.end || d.end <= d.start) return d.to;
  if (d.acceleration > 0) {
    const double t = base::to_seconds(now_ - d.start);
    return d.from + machine::travel_share(d.to - d.from, d.velocity, d.acceleration, t) * (d.to - d.from);
  }
  const double share = base::to_seconds(now_ - d.start) / base::to_seconds(d.end - d.start);
  return d.from + share * (d.to - d.from);
}

bool RigModel::moving(std::size_t axis) const {
  return drives_[axis].stuck || now_ < drives_[axis].end;
}

void RigModel::drive(std::size_t axis, double to, double duration_s) {
  Drive& d = drives_[axis];
  d.from = place(axis);
  d.to = to;
  d.start = now_;
  d.end = now_ + seconds(duration_s);
  d.velocity = d.acceleration = 0;
  d.stuck = chance(faults.stuck);
}

void RigModel::stop_drive(std::size_t axis) {
  Drive& d = drives_[axis];
  ++stops_[axis];
  if (d.homing) d.homing = false;
  if (!moving(axis)) return;
  d.from = d.to = place(axis);
  d.start = now_;
  d.end = now_ + seconds(0.2);  // it brakes
  d.velocity = d.acceleration = 0;
  d.stuck = false;
}

void RigModel::poll(std::size_t axis, std::uint64_t number) {
  Drive& d = drives_[axis];
  if (d.homing && !moving(axis)) {
    d.homing = false;
    d.homed = true;
  }
  drivers::AxisState reading{
      place(axis),          d.enabled,          moving(axis), d.homed, on_low_switch[axis],
      on_high_switch[axis], latched_fault[axis]};
  if (chance(faults.garbage)) {
    switch (random_.below(4)) {
      case 0:
        reading.position_rad = std::numeric_limits<double>::quiet_NaN();
        break;
      case 1:
        reading.position_rad += 0.5;
        break;
      case 2:
        reading.homed = false;
        break;
      default:
        reading.fault = "overheated";
        break;
    }
  }
  answer(AxisPolled{axis, number, reading});
}

void RigModel::fetch(std::uint64_t exposure) {
  if (lost("camera")) return;
  if (chance(faults.lost)) return;
  if (chance(faults.refused)) return answer(DeviceFailed{"the camera refuses"});
  if (!exposing_) return answer(DeviceFailed{"no exposure was triggered"});
  const bool ready = now_ >= exposing_->first + seconds(exposing_->second + setup_.camera.readout_s);
  if (!ready || slots_.size() >= kSlots || chance(faults.garbage)) return answer(FrameNotReady{exposure});
  if (state_.frame && state_.frame->exposure == exposure && state_.frame->row >= 0) {
    const base::Time over = exposing_->first + seconds(exposing_->second);
    for (const Drive& drive : drives_) {
      const bool went = drive.end > drive.start && drive.end > exposing_->first && drive.start < over;
      expect(!went, "an axis moved while the camera exposed");
    }
  }
  if (chance(faults.damaged)) {
    exposing_.reset();
    return answer(FrameDamaged{exposure, "part of it never came"});
  }
  const FrameSlot slot{next_slot_++};
  slots_.insert(slot.index);
  auto histogram = std::make_shared<SampleHistogram>();
  if (chance(0.9)) {
    auto& green = histogram->counts[1];
    green.resize(4096);
    for (int i = 0; i < 100; ++i) ++green[chance(0.1) ? 4095 : random_.below(4096)];
  }
  answer(FrameFetched{exposure,
                      slot,
                      {exposing_->second, 1, exposing_->first, ++frames_},
                      random_.uniform(),
                      histogram,
                      chance(0.5) ? std::make_shared<const std::vector<PreviewPicture>>(1) : nullptr,
                      chance(faults.damaged) ? "lines of zeros" : ""});
  exposing_.reset();
}

void RigModel::release(FrameSlot slot) {
  expect(slots_.erase(slot.index) == 1, "a frame's slot was released that nobody held");
}

void RigModel::replied(const protocol::ClientId& client, std::uint64_t id) {
  expect(client == protocol::ClientId{1, "c"}, "an answer to somebody else");
  expect(open_requests_.erase(id) == 1, "a request was answered twice");
  creating_.erase(id);
}

// The rig stands proven where the pose is, and the pose before is on the disk.
void RigModel::check_trigger() {
  if (!state_.frame || state_.frame->row < 0) return;
  if (!state_.job || !state_.job->current || state_.job->current->row != state_.frame->row) {
    expect(false, "an exposure of a pose that is not being taken");
    return;
  }
  const PoseTake& take = *state_.job->current;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    expect(!moving(i), "an exposure while an axis moves");
    expect(std::abs(place(i) - take.target_rad[i]) <= setup_.rig.axes[i].tolerance_rad + 1e-12,
           "an exposure out of place");
  }
  expect(state_.light.warm && (shutter_ || !setup_.light.has_shutter), "an exposure in the dark");
  expect(exposed_row_ < 0 || exposed_row_ == take.row, "an exposure before the earlier pose was committed");
  exposed_row_ = take.row;
}

void RigModel::check_commit(const CommitPose& commit) {
  const machine::JobConfig& config = scans_.at(open_scan_).config;
  const PoseTake& pose = commit.pose;
  expect(pose.arrived != base::Time{} && pose.arrived <= now_, "a pose is committed that never arrived");
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    expect(std::abs(pose.readback_rad[i] - config.poses.at(static_cast<std::size_t>(pose.row))[i]) <=
               setup_.rig.axes[i].tolerance_rad,
           "a pose is committed without proof of arrival");
  }
  expect(!pose.frames.empty(), "a pose is committed without frames");
  if (config.exposure.strategy == machine::ExposureStrategy::fixed) {
    expect(pose.frames.size() == config.exposure.exposures_s.size(),
           "a pose is committed without all frames");
  }
  if (config.exposure.strategy == machine::ExposureStrategy::predicted) {
    expect(pose.frames.size() == config.exposure.lightest_s.size(), "a pose is committed without all frames");
  }
  if (config.exposure.strategy == machine::ExposureStrategy::adaptive) {
    expect(pose.frames.size() <= static_cast<std::size_t>(config.exposure.most_frames), "too many frames");
    expect(pose.short_share && *pose.short_share >= 0 && *pose.short_share <= 1,
           "an adaptive pose is committed without saying how many pixels fall short");
  }
  for (const scan::FrameRecord& frame : pose.frames) {
    const auto found = stored_.find({pose.row, frame.index});
    expect(found != stored_.end() && !frame.sha256.empty(),
           "a pose is committed before its files are stored");
  }
}

// Mostly of the kind that room mends.
StorageFailed RigModel::no_room(const std::string& what) {
  return {what, 0, disk_refuses || chance(0.8)};
}

void RigModel::to_disk(const Action& action) {
  if (const auto* poll = std::get_if<PollDisk>(&action)) {
    return answer(DiskRead{free_bytes, poll->write && !disk_refuses && !chance(faults.disk)});
  }
  if (const auto* create = std::get_if<CreateJob>(&action)) {
    if (chance(faults.disk)) {
      return answer(JobCreated{create->asker, base::fail(base::ErrorCode::io, "the disk is full")});
    }
    const auto config = machine::parse_job_config(create->submit.job_toml(), "job.toml");
    JobEntry entry;
    entry.id = scans_.empty() ? 1 : scans_.rbegin()->first + 1;
    Scan scan{*config, {}};
    for (std::size_t i = 0; i < config->poses.size(); ++i) {
      scan.rows.push_back({static_cast<std::int64_t>(i), config->poses[i], scan::RowState::pending, 0, {}});
    }
    entry.poses = static_cast<std::int64_t>(scan.rows.size());
    entry.needs_sample_change = config->needs_sample_change;
    scans_[entry.id] = std::move(scan);
    return answer(JobCreated{create->asker, entry});
  }
  if (const auto* open = std::get_if<OpenJob>(&action)) {
    if (disk_refuses || chance(faults.disk)) return answer(no_room("the journal cannot be opened"));
    open_scan_ = open->id;
    stored_.clear();
    const Scan& scan = scans_.at(open->id);
    JobOpened opened{open->id, std::make_shared<const machine::JobConfig>(scan.config), {}, {}};
    opened.progress.total = static_cast<std::int64_t>(scan.rows.size());
    for (const scan::PlanRow& row : scan.rows) {
      if (row.state == scan::RowState::pending) opened.pending.push_back(row);
      if (row.state == scan::RowState::done) ++opened.progress.done;
      if (row.state == scan::RowState::abandoned) ++opened.progress.abandoned;
    }
    opened.visits = scan.visits;
    if (opened.progress.done == 0) opened.visits.first.reset();
    opened.visits.poses_since_good = static_cast<std::int64_t>(scan.unproven.size());
    if (opened.progress.done > 0) {
      auto place = std::make_shared<PlaceReference>();
      place->target_rad = scan.rows.front().target_rad;
      place->exposure_s = 0.02;
      opened.place = std::move(place);
    }
    return answer(std::move(opened));
  }
  if (const auto* store = std::get_if<StoreFrame>(&action)) {
    release(store->slot);
    if (scan_folder_gone) return answer(StorageFailed{"the folder is gone", open_scan_});
    if (disk_refuses || chance(faults.disk)) return answer(no_room("no space left"));
    stored_[{store->pose.row, store->frame.index}] = true;
    return answer(FrameStored{store->pose.row, store->frame.index, "hash", store->pose.number});
  }
  if (const auto* commit = std::get_if<CommitPose>(&action)) {
    if (disk_refuses || chance(faults.disk)) return answer(no_room("no space left"));
    auto& row = scans_.at(open_scan_).rows.at(static_cast<std::size_t>(commit->pose.row));
    expect(row.state == scan::RowState::pending, "a pose is committed twice");
    row.state = scan::RowState::done;
    scans_.at(open_scan_).unproven.push_back(commit->pose.row);
    return answer(PoseCommitted{commit->pose.row});
  }
  if (const auto* look = std::get_if<JudgeLook>(&action)) return judge(*look);
  if (const auto* visit = std::get_if<RecordVisit>(&action)) return record(*visit);
  if (const auto* discard = std::get_if<DiscardBracket>(&action)) {
    std::erase_if(stored_, [&](const auto& frame) { return frame.first.first == discard->row; });
    return;
  }
  if (const auto* failure = std::get_if<RecordFailure>(&action)) {
    auto& row = scans_.at(open_scan_).rows.at(static_cast<std::size_t>(failure->row));
    expect(row.state == scan::RowState::pending, "a pose fails that has ended");
    ++row.attempts;
    row.reason = failure->reason;
    if (failure->abandon) row.state = scan::RowState::abandoned;
  }
}

void RigModel::judge(const JudgeLook& look) {
  release(look.slot);
  if (disk_refuses || chance(faults.disk)) return answer(no_room("the frame cannot be kept"));
  if (chance(faults.bad_visit)) {
    return answer(LookJudged{look.exposure, base::fail(base::ErrorCode::damaged, "it shows nothing")});
  }
  LookFinding finding;
  finding.record.name = look.name;
  finding.record.means_dn = {look.name == "dark" ? dark_dn : patch_dn};
  if (look.name == "flat") finding.record.means_dn = flat_dn;
  finding.tags = tags;
  finding.moved = moved;
  // Not before there is something that it is worse than.
  if (scans_.at(open_scan_).visits.first && chance(faults.bad_visit)) {
    finding.record.means_dn = {500};
    finding.moved = "the fiducials by 9 px";
    finding.tags.clear();
  }
  answer(LookJudged{look.exposure, std::move(finding)});
}

void RigModel::record(const RecordVisit& action) {
  if (disk_refuses || chance(faults.disk)) return answer(no_room("no space left"));
  Scan& scan = scans_.at(open_scan_);
  VisitRecorded recorded{action.visit, {}, {}, {}};
  scan.visits.next = action.visit.number + 1;
  const bool any = std::any_of(scan.rows.begin(), scan.rows.end(),
                               [](const scan::PlanRow& row) { return row.state == scan::RowState::done; });
  if (action.visit.good) {
    if (!any) scan.visits.first = action.visit;
    scan.visits.last_good = action.visit.when;
    scan.unproven.clear();
  }
  if (action.retake) {
    std::swap(recorded.again, scan.unproven);
    for (const std::int64_t row : recorded.again)
      scan.rows.at(static_cast<std::size_t>(row)).state = scan::RowState::pending;
  }
  recorded.progress.total = static_cast<std::int64_t>(scan.rows.size());
  for (const scan::PlanRow& row : scan.rows) {
    if (row.state == scan::RowState::pending) recorded.pending.push_back(row);
    if (row.state == scan::RowState::done) ++recorded.progress.done;
    if (row.state == scan::RowState::abandoned) ++recorded.progress.abandoned;
  }
  answer(std::move(recorded));
}

void RigModel::carry_out(const Action& action) {
  if (const auto* enable = std::get_if<EnableAxis>(&action)) {
    on_channel(
        kAxes,
        [this, i = enable->axis] {
          drives_[i].enabled = true;
          latched_fault[i].clear();
        },
        static_cast<int>(enable->axis));
  } else if (const auto* home = std::get_if<HomeAxis>(&action)) {
    on_channel(
        kAxes,
        [this, i = home->axis] {
          expect(!latched_, "an axis homes after a stop");
          drives_[i].homed = false;
          drives_[i].homing = true;
          drive(i, setup_.rig.axes[i].home_rad, random_.uniform(0.1, 3));
        },
        static_cast<int>(home->axis));
  } else if (const auto* move = std::get_if<MoveAxis>(&action)) {
    on_channel(
        kAxes,
        [this, m = *move] {
          expect(!latched_, "an axis moves after a stop");
          const double off = chance(faults.off_target) ? 0.02 : 0;
          drive(
              m.axis, m.target_rad + off,
              machine::travel_time_s(m.target_rad - place(m.axis), m.velocity_rad_s, m.acceleration_rad_s2));
          drives_[m.axis].velocity = m.velocity_rad_s;
          drives_[m.axis].acceleration = m.acceleration_rad_s2;
        },
        static_cast<int>(move->axis));
  } else if (const auto* jog = std::get_if<JogAxis>(&action)) {
    on_channel(
        kAxes,
        [this, j = *jog] {
          expect(!latched_, "an axis moves after a stop");
          if (refuses_jogs) return answer(JogRefused{j.axis, "this drive cannot"});
          drive(j.axis, place(j.axis) + j.by_rad,
                machine::travel_time_s(j.by_rad, j.velocity_rad_s, j.acceleration_rad_s2));
          drives_[j.axis].velocity = j.velocity_rad_s;
          drives_[j.axis].acceleration = j.acceleration_rad_s2;
        },
        static_cast<int>(jog->axis));
  } else if (const auto* stop = std::get_if<StopAxis>(&action)) {
    stop_drive(stop->axis);
  } else if (const auto* asked = std::get_if<PollAxis>(&action)) {
    on_channel(kAxes, [this, p = *asked] {
      if (chance(faults.lost) || lost(fmt::format("axis {}", machine::kAxisNames[p.axis]))) return;
      if (chance(faults.refused)) return answer(DeviceFailed{"an axis does not talk"});
      poll(p.axis, p.number);
    });
  } else if (std::holds_alternative<ArmCamera>(action)) {
    on_channel(kCamera, [this] { exposing_.reset(); });
  } else if (const auto* trigger = std::get_if<TriggerCamera>(&action)) {
    check_trigger();
    on_channel(kCamera, [this, t = *trigger] {
      if (now_ < busy_until || chance(faults.busy)) return answer(CameraBusy{t.exposure, "it exposes"});
      exposing_ = {now_, t.exposure_s};
      answer(CameraTriggered{t.exposure});
    });
  } else if (const auto* wanted = std::get_if<FetchFrame>(&action)) {
    on_channel(kCamera, [this, exposure = wanted->exposure] { fetch(exposure); });
  } else if (std::holds_alternative<ProbeCamera>(action)) {
    on_channel(kCamera, [this] {
      if (!lost("camera")) answer(CameraAnswered{});
    });
  } else if (std::holds_alternative<ReadCameraTemperature>(action)) {
    on_channel(kCamera, [this] {
      if (!lost("camera")) answer(CameraTemperatureRead{camera_temperature_c});
    });
  } else if (std::holds_alternative<AbortCamera>(action)) {
    on_channel(kCamera, [this] { exposing_.reset(); });
  } else if (const auto* level = std::get_if<SetLightLevel>(&action)) {
    on_channel(kLight, [this, l = level->level] {
      if (level_ <= 0 && l > 0) lit_ = now_;
      level_ = l;
    });
  } else if (const auto* shutter = std::get_if<SetShutter>(&action)) {
    on_channel(kLight, [this, open = shutter->open] { shutter_ = open; });
  } else if (const auto* look = std::get_if<PollLight>(&action)) {
    on_channel(kLight, [this, number = look->number] {
      if (chance(faults.lost)) return;
      const bool warm = level_ > 0 && now_ >= lit_ + seconds(setup_.light.warm_up_s);
      drivers::LightState light{level_ > 0, shutter_, level_, warm, 0, chance(faults.garbage) ? "lamp" : ""};
      if (on_light_read) on_light_read(light);
      answer(LightPolled{number, light});
    });
  } else if (const auto* lines = std::get_if<ReadLines>(&action)) {
    on_channel(kLight, [this, asked = lines->asked] { read_lines(asked); });
  } else if (const auto* released = std::get_if<ReleaseFrame>(&action)) {
    release(released->slot);
  } else if (const auto* reply = std::get_if<SendReply>(&action)) {
    replied(reply->client, reply->reply.id());
    replies_.push_back(reply->reply);
  } else if (const auto* frame = std::get_if<ReplyWithFrame>(&action)) {
    replied(frame->asker.client, frame->asker.id);
    release(frame->slot);
    protocol::Reply done;
    done.set_id(frame->asker.id);
    done.set_outcome(protocol::DONE);
    replies_.push_back(done);
  } else if (const auto* subscribe = std::get_if<SubscribeClient>(&action)) {
    replied(subscribe->asker.client, subscribe->asker.id);
  } else if (const auto* space = std::get_if<CheckSpace>(&action)) {
    replied(space->asker.client, space->asker.id);
    protocol::Reply done;
    done.set_id(space->asker.id);
    done.set_outcome(protocol::DONE);
    *done.mutable_preflight() = space->preflight;
    replies_.push_back(done);
  } else if (const auto* report = std::get_if<SendReport>(&action)) {
    replied(report->asker.client, report->asker.id);
    protocol::Reply done;
    done.set_id(report->asker.id);
    done.set_outcome(protocol::DONE);
    replies_.push_back(done);
  } else if (const auto* preview = std::get_if<PublishPreview>(&action)) {
    expect(preview->previews != nullptr, "a preview without a picture");
  } else {
    if (const auto* create = std::get_if<CreateJob>(&action)) creating_.insert(create->asker.id);
    if (const auto* commit = std::get_if<CommitPose>(&action)) check_commit(*commit);
    if (const auto* discard = std::get_if<DiscardBracket>(&action)) {
      if (exposed_row_ == discard->row) exposed_row_ = -1;
    }
    // A stop leaves a commit that is under way to the disk; the job is then opened behind it.
    if (std::holds_alternative<OpenJob>(action)) exposed_row_ = -1;
    on_channel(kDisk, [this, action] { to_disk(action); });
  }
}

void RigModel::check_at_rest() {
  expect(slots_.empty(), "a frame's slot leaked");
  expect(open_requests_.empty(), "a request was never answered");
  for (const std::uint64_t job : completed_) {
    for (const scan::PlanRow& row : scans_.at(job).rows) {
      const bool abandoned = row.state == scan::RowState::abandoned && !row.reason.empty();
      expect(row.state == scan::RowState::done || abandoned, "a complete job has a pose without an end");
    }
  }
}

}  // namespace rig::daemon::testing
