// Jobs on a model of the rig, for tests that set up a situation on purpose.
#pragma once

#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "tests/daemon/rig_model.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {

class JobTest : public ::testing::Test {
 protected:
  JobTest() { restart(); }

  /// A new rigd with this setup: homed, at rest, without jobs.
  void restart() {
    State state;
    state.now = base::Time(base::seconds(1e6));
    state.look_at = state.now;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      state.axes[i].last.position_rad = some_poses()[0][i];
      state.axes[i].last.homed = true;
      state.axes[i].known = true;
    }
    model_ = std::make_unique<RigModel>(setup_, state, 1);
  }
  void add_job(const machine::JobConfig& config, std::uint64_t id = 1) {
    JobEntry entry;
    entry.id = id;
    entry.sample = config.sample;
    entry.needs_sample_change = config.needs_sample_change;
    model_->add_job(entry, config);
  }
  void run_until(const std::function<bool()>& done) {
    for (int i = 0; i < 200000 && !done(); ++i) model_->advance(model_->now() + base::seconds(1));
    ASSERT_TRUE(done());
    ASSERT_TRUE(model_->broken().empty()) << model_->broken().front();
  }
  void run_for(double duration_s) {
    const auto end = model_->now() + base::seconds(duration_s);
    while (model_->now() < end) model_->advance(end);
    ASSERT_TRUE(model_->broken().empty()) << model_->broken().front();
  }
  const protocol::Reply& ask(const protocol::Request& request) {
    const std::size_t before = model_->replies().size();
    model_->request(request);
    for (int i = 0; i < 200000 && model_->replies().size() == before; ++i) {
      model_->advance(model_->now() + base::seconds(1));
    }
    EXPECT_GT(model_->replies().size(), before);
    return model_->replies().back();
  }
  /// What [notify] was told, in order.
  std::vector<std::string> occasions() {
    std::vector<std::string> told;
    for (const TellOfJob& tell : actions<TellOfJob>()) told.push_back(tell.occasion);
    return told;
  }
  const protocol::Reply& hold(std::uint64_t id, const std::string& reason) {
    protocol::Request request;
    request.mutable_hold_job()->set_job(id);
    request.mutable_hold_job()->set_reason(reason);
    return ask(request);
  }
  const protocol::Reply& release(std::uint64_t id) {
    protocol::Request request;
    request.mutable_release_job()->set_job(id);
    return ask(request);
  }
  protocol::JobInfo show(std::uint64_t id) {
    protocol::Request request;
    request.mutable_show_job()->set_job(id);
    return ask(request).job();
  }
  [[nodiscard]] const JobEntry& entry(std::uint64_t id = 1) const {
    for (const JobEntry& job : model_->state().jobs) {
      if (job.id == id) return job;
    }
    throw std::logic_error("no such job");
  }
  [[nodiscard]] bool resting() const { return model_->state().job && model_->state().job->resting; }
  [[nodiscard]] bool ended(std::uint64_t id, JobEntry::State how) const { return entry(id).state == how; }
  void run_to_completion(std::uint64_t id = 1) {
    run_until([&] { return ended(id, JobEntry::State::complete); });
  }
  /// The conditions that came on and went off so far: "+light", "-light", ...
  [[nodiscard]] std::vector<std::string> suspensions() const {
    std::vector<std::string> all;
    for (const auto& event : model_->events()) {
      if (event.has_job_suspended()) all.push_back("+" + event.job_suspended().condition());
      if (event.has_job_released()) all.push_back("-" + event.job_released().condition());
    }
    return all;
  }
  template <typename T>
  std::vector<T> actions(std::size_t from = 0) const {
    std::vector<T> found;
    for (std::size_t i = from; i < model_->history().size(); ++i) {
      if (const auto* action = std::get_if<T>(&model_->history()[i])) found.push_back(*action);
    }
    return found;
  }

  daemon::Setup setup_ = small_setup();
  std::unique_ptr<RigModel> model_;
};

}  // namespace rig::daemon::testing
