// rigd on the small virtual rig in a folder of a test, and a client of it.
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <string>

#include "core/base/files.h"
#include "protocol/client.h"
#include "tests/core/temporary_folder.h"
#include "tests/system/program.h"
#include "tests/system/small_rig.h"

namespace rig::test {

inline constexpr std::chrono::milliseconds kPatience{120000};

/// state/, run/, rig.toml, job.toml and scan/ in `folder`; rigd itself is started by start().
class RunningRig {
 public:
  explicit RunningRig(const std::filesystem::path& folder, const std::string& rig_toml = small_rig_toml())
      : folder_(folder) {
    std::filesystem::create_directories(folder_);
    put_bytes(folder_ / "rig.toml", rig_toml);
  }

  /// `further`: arguments of rigd.
  void start(const std::vector<std::string>& further = {}) {
    std::vector<std::string> arguments{"--config",        folder_ / "rig.toml", "--state",
                                       folder_ / "state", "--runtime",          folder_ / "run"};
    arguments.insert(arguments.end(), further.begin(), further.end());
    rigd_ = std::make_unique<Program>("rigd", arguments, folder_ / "rigd.log");
    auto client = protocol::Client::connect("ipc://" + (folder_ / "run/operate.sock").string());
    ASSERT_TRUE(client.has_value()) << client.error().text();
    client_ = std::make_unique<protocol::Client>(std::move(*client));
    // Answered as soon as rigd listens, with what happened since it started.
    protocol::Request look;
    look.mutable_get_status();
    protocol::Request request;
    request.mutable_subscribe()->set_epoch(expect_done(look).status().epoch());
    const protocol::Reply reply = expect_done(request);
    missed_.assign(reply.catch_up().missed().begin(), reply.catch_up().missed().end());
  }

  /// Ends rigd by a signal; the exit status or minus the signal.
  int end(int signal) {
    client_.reset();
    const int status = rigd_->signal(signal);
    rigd_.reset();
    return status;
  }

  [[nodiscard]] pid_t pid() const { return rigd_->pid(); }

  protocol::Reply ask(const protocol::Request& request) {
    auto reply = client_->ask(request, kPatience);
    EXPECT_TRUE(reply.has_value()) << reply.error().text() << "\n" << log();
    return reply ? *reply : protocol::Reply();
  }
  protocol::Reply expect_done(const protocol::Request& request) {
    const protocol::Reply reply = ask(request);
    EXPECT_EQ(reply.outcome(), protocol::DONE) << reply.reason();
    return reply;
  }
  /// Sends what is answered much later, and does not wait for that.
  void send(const protocol::Request& request) {
    const auto reply = client_->ask(request, std::chrono::milliseconds(1));
    EXPECT_TRUE(!reply && reply.error().code == base::ErrorCode::timeout);
  }
  void submit(const std::string& job_toml) {
    protocol::Request request;
    request.mutable_submit_job()->set_job_toml(job_toml);
    request.mutable_submit_job()->set_job_name("job.toml");
    request.mutable_submit_job()->set_scan_folder(scan().string());
    expect_done(request);
  }

  /// Events until one for which `wanted` is true; false where none came in time.
  template <typename Wanted>
  [[nodiscard]] bool await(Wanted wanted) {
    while (!missed_.empty()) {
      const protocol::Event event = missed_.front();
      missed_.pop_front();
      if (wanted(event)) return true;
    }
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < end) {
      const auto event = client_->next_event(std::chrono::milliseconds(1000));
      if (!event) return false;
      if (*event && wanted(**event)) return true;
    }
    return false;
  }
  /// Waits for the end of job 1; its last state.
  protocol::JobState await_job_end() {
    protocol::Request request;
    request.mutable_show_job()->set_job(1);
    protocol::JobState state = ask(request).job().state();
    const auto ended = [&state] {
      return state == protocol::COMPLETE || state == protocol::ABORTED || state == protocol::JOB_FAILED;
    };
    if (ended()) return state;
    EXPECT_TRUE(await([&](const protocol::Event& event) {
      if (!event.has_job_changed()) return false;
      state = event.job_changed().job().state();
      return ended();
    })) << log();
    return state;
  }

  [[nodiscard]] std::filesystem::path scan() const { return folder_ / "scan"; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::string log() const { return bytes_in(folder_ / "rigd.log"); }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<Program> rigd_;
  std::unique_ptr<protocol::Client> client_;
  std::deque<protocol::Event> missed_;
};

/// The bytes of every frame of a scan by its name.
inline std::map<std::string, std::string> frames_of(const std::filesystem::path& scan) {
  std::map<std::string, std::string> frames;
  for (const std::string& name : everything_in(scan / "frames")) {
    const auto path = scan / "frames" / name;
    if (std::filesystem::is_regular_file(path)) frames[name] = bytes_in(path);
  }
  return frames;
}

/// A plan of about a dozen poses with brackets of two, made by rig-plan.
inline std::string small_job(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  put_bytes(folder / "rig.toml", small_rig_toml());
  const int status =
      run_program("rig-plan",
                  {"--rig", folder / "rig.toml", "--angle-deg", "30", "--exposures-us", "60000,8000",
                   "--name", "small", "--sample", "chart", "--out", folder / "job.toml"},
                  folder / "plan.log");
  EXPECT_EQ(status, 0) << bytes_in(folder / "plan.log");
  return bytes_in(folder / "job.toml");
}

}  // namespace rig::test
