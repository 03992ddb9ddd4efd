#include "tests/daemon/rig_model.h"

#include <algorithm>

namespace rig::daemon::testing {

using base::seconds;

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

void RigModel::release(FrameSlot slot) {
  expect(slots_.erase(slot.index) == 1, "a frame's slot was released that nobody held");
}

void RigModel::replied(const protocol::ClientId& client, std::uint64_t id) {
  expect(client == protocol::ClientId{1, "c"}, "an answer to somebody else");
  expect(open_requests_.erase(id) == 1, "a request was answered twice");
  creating_.erase(id);
}

// Whether it was for a client or the frame pool.
bool RigModel::to_client(const Action& action) {
  if (const auto* released = std::get_if<ReleaseFrame>(&action)) {
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
    return false;
  }
  return true;
}

void RigModel::carry_out(const Action& action) {
  if (to_device(action) || to_client(action)) return;
  if (const auto* create = std::get_if<CreateJob>(&action)) creating_.insert(create->asker.id);
  if (const auto* commit = std::get_if<CommitPose>(&action)) check_commit(*commit);
  if (const auto* discard = std::get_if<DiscardBracket>(&action)) {
    if (exposed_row_ == discard->row) exposed_row_ = -1;
  }
  // A stop leaves a commit that is under way to the disk; the job is then opened behind it.
  if (std::holds_alternative<OpenJob>(action)) exposed_row_ = -1;
  on_channel(kDisk, [this, action] { to_disk(action); });
}

}  // namespace rig::daemon::testing
