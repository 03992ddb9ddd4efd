#include "clients/rig/watch.h"

#include <set>

#include "clients/rig/format.h"
#include "clients/rig/terminal.h"
#include "clients/rig/watch_screen.h"
#include "core/base/interrupt.h"
#include "core/base/progress.h"
#include "protocol/client.h"

namespace rig::client {

using base::ErrorCode;
using base::Result;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

constexpr milliseconds kAnswer{2000};
constexpr milliseconds kPatience{250};
// Without an event for so long rigd is asked whether it is still there.
constexpr std::chrono::seconds kSilence{2};

// How often positions are asked for where they are shown.
constexpr std::chrono::milliseconds kLook{500};

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options),
        screen_(!options.lines && is_terminal() ? make_full_screen() : make_line_screen()) {}

  Result<void> run() {
    while (!base::interrupted()) {
      const auto next = follow_one_connection();
      if (next && *next == Next::end) return verdict();
      if (!next && next.error().code != ErrorCode::timeout) return base::pass(next);
      if (!next) lost(next.error().text());
    }
    return base::interrupted_error("rigd goes on without being watched");
  }

 private:
  // `end`: idle, and that was asked for. `reconnect`: rigd was started again and knows of no subscription.
  enum class Next { go_on, reconnect, end };

  // What was not done is an Error: a refusal must not look like a rig without jobs.
  static Result<protocol::Reply> ask(protocol::Client& client, const protocol::Request& request) {
    auto reply = client.ask(request, kAnswer);
    if (!reply || reply->outcome() == protocol::DONE) return reply;
    const bool refused = reply->outcome() == protocol::REFUSED;
    return base::fail(refused ? ErrorCode::refused : ErrorCode::device,
                      fmt::format("{}: {}", refused ? "refused" : "failed", reply->reason()));
  }

  // A time-out: rigd does not answer.
  Result<Next> follow_one_connection() {
    auto client = protocol::Client::connect(options_.endpoint);
    if (!client) return base::pass(client);
    protocol::Request subscribe;
    subscribe.mutable_subscribe()->set_epoch(epoch_);
    subscribe.mutable_subscribe()->set_after(number_);
    subscribe.mutable_subscribe()->set_previews(screen_->is_full());
    subscribe.mutable_subscribe()->set_preview_width(options_.preview_width);
    subscribe.mutable_subscribe()->set_preview_every_ms(options_.preview_every_ms);
    auto reply = ask(*client, subscribe);
    if (!reply) return base::pass(reply);
    for (const auto& event : reply->catch_up().missed()) take_in(event);
    subscribed_to_ = 0;
    if (auto next = ask_state(*client); !next || *next != Next::go_on) return next;
    auto heard = Steady::now();
    const Steady::duration silence =
        screen_->is_full() ? Steady::duration(kLook) : Steady::duration(kSilence);
    while (!base::interrupted()) {
      auto event = client->next_event(kPatience);
      if (!event) return base::pass(event);
      if (*event) {
        if (!screen_->is_full()) heard = Steady::now();
        take_in(**event);
        if ((*event)->has_job_changed() && options_.until_idle) {
          if (auto next = ask_state(*client); !next || *next != Next::go_on) return next;
        }
      }
      // A full screen shows positions, also between events; lines only want to know whether rigd is there.
      if ((screen_->is_full() || !*event) && Steady::now() - heard > silence) {
        if (auto next = ask_state(*client); !next || *next != Next::go_on) return next;
        heard = Steady::now();
      }
    }
    return Next::reconnect;
  }

  Result<Next> ask_state(protocol::Client& client) {
    protocol::Request status;
    status.mutable_get_status();
    auto reply = ask(client, status);
    if (!reply) return base::pass(reply);
    view_.status = reply->status();
    const std::uint64_t epoch = reply->status().epoch();
    if (subscribed_to_ != 0 && subscribed_to_ != epoch) return Next::reconnect;
    subscribed_to_ = epoch;
    if (epoch_ != epoch) {
      epoch_ = epoch;
      number_ = reply->status().last_event();
    }
    if (reply->status().mode() == protocol::STOPPED && stop_reason_ != reply->status().stop_reason()) {
      stop_reason_ = reply->status().stop_reason();
      screen_->message(fmt::format("stopped: {}; `rig clear` lets the job go on", stop_reason_));
    }
    protocol::Request list;
    list.mutable_list_jobs();
    reply = ask(client, list);
    if (!reply) return base::pass(reply);
    bool idle = true;
    for (const auto& job : reply->jobs().jobs()) {
      // One that is held may be the one that rigd is at, or wait in the queue, where nothing suspends it.
      if (job.state() == protocol::ACTIVE || !job.suspensions().empty()) take_up(job);
      if (goes_on(job)) {
        idle = false;
        followed_.insert(job.job());
      }
      if (followed_.count(job.job()) != 0 &&
          (job.state() == protocol::ABORTED || job.state() == protocol::JOB_FAILED)) {
        failed_ = fmt::format("job {} '{}': {}", job.job(), job.name(), job.reason());
      }
    }
    update();
    return idle && options_.until_idle ? Next::end : Next::go_on;
  }

  void take_in(const protocol::Event& event) {
    if (event.number() != 0) {
      epoch_ = event.epoch();
      number_ = event.number();
    }
    if (event.has_job_changed()) {
      const auto& job = event.job_changed().job();
      followed_.insert(job.job());
      // A job that is put into the queue does not take the place of the one that runs.
      if (job.state() == protocol::ACTIVE || job.job() == job_.job()) show(job);
      if (job.state() != protocol::ACTIVE && job.state() != protocol::SUSPENDED) {
        screen_->message(describe_job(job));
      }
    } else if (event.has_pose_started()) {
      const auto& p = event.pose_started();
      pose_ = fmt::format("row {} at {:.1f} deg", p.row(),
                          fmt::join(p.target_deg().begin(), p.target_deg().end(), " "));
      view_.pose = p;
      update();
    } else if (event.has_frame_taken()) {
      auto& bracket = view_.bracket;
      const bool begins = bracket.empty() || event.frame_taken().index() == 0 ||
                          event.frame_taken().row() != bracket.front().row();
      if (begins) bracket.clear();
      bracket.push_back(event.frame_taken());
      update();
    } else if (event.has_preview()) {
      view_.preview = event.preview().frame();
      update();
    } else if (event.has_pose_committed()) {
      job_.set_done(event.pose_committed().done());
      job_.set_poses(event.pose_committed().poses());
      update();
    } else if (event.has_pose_failed()) {
      const auto& p = event.pose_failed();
      screen_->message(fmt::format("row {}: attempt {} {}: {}", p.row(), p.attempt(),
                                   p.abandoned() ? "failed, abandoned" : "failed", p.reason()));
    } else if (event.has_stop_latched()) {
      stop_reason_ = event.stop_latched().reason();
      screen_->message(fmt::format("stopped: {}; `rig clear` lets the job go on", stop_reason_));
    } else if (event.has_stop_cleared()) {
      stop_reason_.clear();
      screen_->message("the stop was cleared");
    } else if (event.has_job_suspended()) {
      const auto& suspended = event.job_suspended();
      screen_->message(fmt::format("job {} is suspended, {}: {}", suspended.job(), suspended.condition(),
                                   suspended.reason()));
    } else if (event.has_job_released()) {
      const auto& released = event.job_released();
      screen_->message(fmt::format("job {}: {} has ended; {}", released.job(), released.condition(),
                                   released.goes_on() ? "it goes on" : "it stays suspended"));
    } else if (event.has_place_checked()) {
      const auto& checked = event.place_checked();
      if (!checked.problem().empty()) screen_->message(checked.problem());
    } else if (event.has_reference_visited()) {
      const auto& visited = event.reference_visited();
      std::string found = fmt::format("{}; {} poses are queued again", visited.what(), visited.poses_again());
      if (!visited.good() && visited.what().empty()) {
        found = "the first, it is made again";
      } else if (visited.good() && visited.what().empty()) {
        found = fmt::format("good, the patches have {:.4f} of their first radiance", visited.level());
        if (visited.flat_level() > 0) found += fmt::format(", the flat {:.4f} of its", visited.flat_level());
      }
      screen_->message(fmt::format("reference visit {}: {}", visited.visit(), found));
    } else if (event.has_alarm()) {
      screen_->message("alarm: " + event.alarm().text());
    }
  }

  static bool goes_on(const protocol::JobInfo& job) {
    return job.state() == protocol::QUEUED || job.state() == protocol::ACTIVE ||
           job.state() == protocol::HELD || job.state() == protocol::SUSPENDED;
  }

  void take_up(const protocol::JobInfo& job) {
    if (job_.job() != job.job()) {
      start_ = Steady::now();
      done_at_start_ = job.done();
    }
    job_ = job;
  }

  void show(const protocol::JobInfo& job) {
    take_up(job);
    update();
  }

  void update() {
    view_.job = job_;
    view_.seconds_left = -1;
    std::string progress;
    if (job_.state() == protocol::ACTIVE && job_.poses() > 0) {
      // At the pace that is seen here: a virtual rig's own hours pass in minutes.
      const double elapsed = std::chrono::duration<double>(Steady::now() - start_).count();
      const auto fresh = static_cast<double>(job_.done() - done_at_start_);
      if (fresh > 0) {
        view_.seconds_left =
            elapsed / fresh * static_cast<double>(job_.poses() - job_.done() - job_.abandoned());
      }
      const std::string left = fresh > 0 ? base::format_duration(view_.seconds_left) + " left"
                                         : std::string("time left not known yet");
      progress = fmt::format("job {} '{}': {}/{} poses, {}; {}", job_.job(), job_.name(), job_.done(),
                             job_.poses(), left, pose_);
    } else if (!job_.suspensions().empty()) {
      progress = fmt::format("job {} '{}': {}/{} poses, suspended", job_.job(), job_.name(), job_.done(),
                             job_.poses());
      for (const auto& on : job_.suspensions())
        progress += fmt::format("; {}: {}", describe_suspension(on), on.reason());
    }
    screen_->show(view_, progress);
  }

  void lost(const std::string& why) {
    view_.status.set_mode(protocol::MODE_UNSPECIFIED);
    view_.status.set_stop_reason(why);
    screen_->show(view_, why + "; trying again");
  }

  Result<void> verdict() {
    if (failed_.empty()) return {};
    return base::fail(ErrorCode::device, failed_);
  }

  const WatchOptions options_;
  const std::unique_ptr<WatchScreen> screen_;
  WatchView view_;
  std::uint64_t epoch_ = 0;
  std::uint64_t number_ = 0;
  std::uint64_t subscribed_to_ = 0;  // epoch; 0: not known yet
  protocol::JobInfo job_;
  std::int64_t done_at_start_ = 0;
  Steady::time_point start_ = Steady::now();
  std::string pose_;
  std::string stop_reason_;
  std::string failed_;
  std::set<std::uint64_t> followed_;
};

}  // namespace

Result<void> watch(const WatchOptions& options) {
  return Watch(options).run();
}

}  // namespace rig::client
