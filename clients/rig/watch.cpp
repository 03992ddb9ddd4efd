#include "clients/rig/watch.h"

#include <cstdio>
#include <set>
#include <unistd.h>

#include "clients/rig/format.h"
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

// What the screen shows, kept from events.
class Screen {
 public:
  void line(const std::string& text) {
    clear();
    std::printf("%s\n", text.c_str());
    std::fflush(stdout);
  }
  // One line that is overwritten on a terminal; elsewhere a line at most every ten seconds.
  void progress(const std::string& text) {
    const auto now = Steady::now();
    if (terminal_) {
      std::printf("\r\033[K%s", text.c_str());
      std::fflush(stdout);
      open_ = true;
    } else if (now - printed_ > std::chrono::seconds(10)) {
      printed_ = now;
      line(text);
    }
  }
  void clear() {
    if (open_) std::printf("\r\033[K");
    open_ = false;
  }

 private:
  const bool terminal_ = ::isatty(STDOUT_FILENO) == 1;
  bool open_ = false;
  Steady::time_point printed_ = Steady::now() - std::chrono::seconds(60);
};

class Watch {
 public:
  explicit Watch(const WatchOptions& options) : options_(options) {}

  Result<void> run() {
    while (!base::interrupted()) {
      const auto next = follow_one_connection();
      screen_.clear();
      if (next && *next == Next::end) return verdict();
      if (!next && next.error().code != ErrorCode::timeout) return base::pass(next);
      if (!next) screen_.progress(next.error().text() + "; trying again");
    }
    screen_.clear();
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
    auto reply = ask(*client, subscribe);
    if (!reply) return base::pass(reply);
    for (const auto& event : reply->catch_up().missed()) take_in(event);
    subscribed_to_ = 0;
    if (auto next = ask_state(*client); !next || *next != Next::go_on) return next;
    auto heard = Steady::now();
    while (!base::interrupted()) {
      auto event = client->next_event(kPatience);
      if (!event) return base::pass(event);
      if (*event) {
        heard = Steady::now();
        take_in(**event);
        if ((*event)->has_job_changed() && options_.until_idle) {
          if (auto next = ask_state(*client); !next || *next != Next::go_on) return next;
        }
      } else if (Steady::now() - heard > kSilence) {
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
    const std::uint64_t epoch = reply->status().epoch();
    if (subscribed_to_ != 0 && subscribed_to_ != epoch) return Next::reconnect;
    subscribed_to_ = epoch;
    if (epoch_ != epoch) {
      epoch_ = epoch;
      number_ = reply->status().last_event();
    }
    if (reply->status().mode() == protocol::STOPPED && stop_reason_ != reply->status().stop_reason()) {
      stop_reason_ = reply->status().stop_reason();
      screen_.line(fmt::format("stopped: {}; `rig clear` lets the job go on", stop_reason_));
    }
    protocol::Request list;
    list.mutable_list_jobs();
    reply = ask(client, list);
    if (!reply) return base::pass(reply);
    bool idle = true;
    for (const auto& job : reply->jobs().jobs()) {
      if (job.state() == protocol::ACTIVE) show(job);
      if (job.state() == protocol::QUEUED || job.state() == protocol::ACTIVE) {
        idle = false;
        followed_.insert(job.job());
      }
      if (followed_.count(job.job()) != 0 &&
          (job.state() == protocol::ABORTED || job.state() == protocol::JOB_FAILED)) {
        failed_ = fmt::format("job {} '{}': {}", job.job(), job.name(), job.reason());
      }
    }
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
      if (job.state() != protocol::ACTIVE) screen_.line(describe_job(job));
    } else if (event.has_pose_started()) {
      const auto& p = event.pose_started();
      pose_ = fmt::format("row {} at {:.1f} deg", p.row(),
                          fmt::join(p.target_deg().begin(), p.target_deg().end(), " "));
      update();
    } else if (event.has_pose_committed()) {
      job_.set_done(event.pose_committed().done());
      job_.set_poses(event.pose_committed().poses());
      update();
    } else if (event.has_pose_failed()) {
      const auto& p = event.pose_failed();
      screen_.line(fmt::format("row {}: attempt {} {}: {}", p.row(), p.attempt(),
                               p.abandoned() ? "failed, abandoned" : "failed", p.reason()));
    } else if (event.has_stop_latched()) {
      stop_reason_ = event.stop_latched().reason();
      screen_.line(fmt::format("stopped: {}; `rig clear` lets the job go on", stop_reason_));
    } else if (event.has_stop_cleared()) {
      stop_reason_.clear();
      screen_.line("the stop was cleared");
    } else if (event.has_alarm()) {
      screen_.line("alarm: " + event.alarm().text());
    }
  }

  void show(const protocol::JobInfo& job) {
    if (job_.job() != job.job()) {
      start_ = Steady::now();
      done_at_start_ = job.done();
    }
    job_ = job;
    update();
  }

  void update() {
    if (job_.state() != protocol::ACTIVE || job_.poses() == 0) return;
    // At the pace that is seen here: a virtual rig's own hours pass in minutes.
    const double elapsed = std::chrono::duration<double>(Steady::now() - start_).count();
    const auto fresh = static_cast<double>(job_.done() - done_at_start_);
    std::string left = "time left not known yet";
    if (fresh > 0) {
      left = base::format_duration(elapsed / fresh *
                                   static_cast<double>(job_.poses() - job_.done() - job_.abandoned())) +
             " left";
    }
    screen_.progress(fmt::format("job {} '{}': {}/{} poses, {}; {}", job_.job(), job_.name(), job_.done(),
                                 job_.poses(), left, pose_));
  }

  Result<void> verdict() {
    if (failed_.empty()) return {};
    return base::fail(ErrorCode::device, failed_);
  }

  const WatchOptions options_;
  Screen screen_;
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
