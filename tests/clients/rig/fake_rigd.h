// Something that answers in rigd's place, through the real server.
#pragma once

#include <functional>
#include <gtest/gtest.h>
#include <mutex>
#include <optional>
#include <vector>

#include "protocol/server.h"

namespace rig::test {

class FakeRigd {
 public:
  /// Called on the server's thread with every request; nothing: no answer.
  using Answer = std::function<std::optional<protocol::Reply>(const protocol::Request&, FakeRigd&)>;

  FakeRigd(std::filesystem::path folder, Answer answer)
      : folder_(std::move(folder)), answer_(std::move(answer)) {
    const std::lock_guard until_started(mutex_);
    protocol::ServerOptions options;
    options.folder = folder_;
    auto server = protocol::Server::start(options, [this](protocol::Incoming in) { take(in); });
    EXPECT_TRUE(server.has_value()) << server.error().text();
    if (server) server_ = std::move(*server);
  }
  FakeRigd(const FakeRigd&) = delete;
  FakeRigd& operator=(const FakeRigd&) = delete;

  [[nodiscard]] std::string endpoint() const { return "ipc://" + (folder_ / "operate.sock").string(); }

  /// From inside an Answer: an event to follow it.
  void then(protocol::Event event) { held_back_.push_back(std::move(event)); }

  [[nodiscard]] std::vector<protocol::Request> requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  void take(const protocol::Incoming& in) {
    const std::lock_guard lock(mutex_);
    requests_.push_back(in.request);
    if (in.request.has_subscribe()) server_->subscribe(in.client, std::nullopt);
    held_back_.clear();
    auto reply = answer_(in.request, *this);
    if (reply) {
      reply->set_id(in.request.id());
      server_->reply(in.client, *reply);
    }
    // In epoch 1, numbered from 1 on, as rigd does.
    for (auto& event : held_back_) {
      event.set_epoch(1);
      event.set_number(++last_event_);
      server_->publish(event);
    }
  }

  const std::filesystem::path folder_;
  const Answer answer_;
  mutable std::mutex mutex_;
  std::vector<protocol::Request> requests_;
  std::vector<protocol::Event> held_back_;
  std::uint64_t last_event_ = 0;
  std::unique_ptr<protocol::Server> server_;  // last: its thread ends before the rest does
};

inline protocol::Reply outcome(protocol::Outcome outcome, const std::string& reason = {}) {
  protocol::Reply reply;
  reply.set_outcome(outcome);
  reply.set_reason(reason);
  return reply;
}

inline protocol::JobInfo job_of(std::uint64_t number, protocol::JobState state, std::int64_t done = 0,
                                const std::string& reason = {}) {
  protocol::JobInfo job;
  job.set_job(number);
  job.set_name("night");
  job.set_sample("cloth");
  job.set_state(state);
  job.set_scan_folder("/scans/1");
  job.set_poses(4);
  job.set_done(done);
  job.set_reason(reason);
  return job;
}

}  // namespace rig::test
