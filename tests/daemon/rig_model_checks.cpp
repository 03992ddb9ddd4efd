// What has to be true at every step.
#include <algorithm>
#include <cmath>

#include "core/base/units.h"
#include "core/machine/limits.h"
#include "tests/daemon/rig_model.h"

namespace rig::daemon::testing {

namespace {

bool energises(const Action& action) {
  if (const auto* level = std::get_if<SetLightLevel>(&action)) return level->level > 0;
  if (const auto* shutter = std::get_if<SetShutter>(&action)) return shutter->open;
  return std::holds_alternative<EnableAxis>(action) || std::holds_alternative<HomeAxis>(action) ||
         std::holds_alternative<MoveAxis>(action) || std::holds_alternative<JogAxis>(action) ||
         std::holds_alternative<ArmCamera>(action) || std::holds_alternative<TriggerCamera>(action);
}

}  // namespace

void RigModel::expect(bool holds, const std::string& what) {
  if (!holds) broken_.push_back("step " + std::to_string(steps_) + ": " + what);
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

void RigModel::check_request_books() {
  std::set<std::uint64_t> waiting = creating_;
  if (state_.motion && state_.motion->asker) waiting.insert(state_.motion->asker->id);
  if (state_.snap) waiting.insert(state_.snap->asker.id);
  expect(waiting == open_requests_, "a request is neither answered nor under way");
  open_requests_ = waiting;
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
  // Put off it may be, where the rig cannot go there.
  const bool proven = !setup_.rig.unattended.reference || scans_.at(open_scan_).visits.since_good.empty();
  expect(proven, "an exposure after a visit that was not good");
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
