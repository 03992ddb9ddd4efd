// Keeps a session with the camera: waits for its answers so that the caller need not, and opens it again
// where it went.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "core/base/result.h"
#include "drivers/aravis_camera/session.h"
#include "drivers/common/timed_mutex.h"

namespace rig::drivers::aravis {

/// Aravis waits seconds for a camera that is silent; rigd must not. So a thread of its own talks with the
/// camera, and a call that it cannot answer in time is answered `lost` here.
class Keeper {
 public:
  /// Opens a session; `on_lost` is to be called from any thread when the wire says that it is gone.
  using Open = std::function<base::Result<std::unique_ptr<Session>>(std::function<void()> on_lost)>;

  Keeper(Open open, std::string called, std::chrono::milliseconds answer, Log log);
  /// Closes the session; of a camera that is gone that takes seconds.
  ~Keeper();
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  /// The first opening. An error: what the last try said, where none succeeds in time, or at once where the
  /// camera is there and cannot be configured.
  [[nodiscard]] base::Result<CameraCapabilities> wait_until_open(std::chrono::milliseconds within);

  /// `work` on the keeper's thread. No answer in time, and a camera that is away: lost.
  template <typename T>
  [[nodiscard]] base::Result<T> ask(std::function<base::Result<T>(Session&)> work) {
    auto answer = std::make_shared<std::optional<base::Result<T>>>();
    auto done = run([answer, work = std::move(work)](Session& session) -> base::Result<void> {
      *answer = work(session);
      if (!**answer) return base::pass(**answer);
      return {};
    });
    if (!done) return base::pass(done);
    return std::move(**answer);
  }

  /// `work` on the caller's thread: for what does not talk with the camera.
  template <typename T>
  [[nodiscard]] base::Result<T> look(const std::function<base::Result<T>(Session&)>& work) {
    const std::unique_lock use(use_, answer_);
    if (!use.owns_lock()) return base::pass(silent());
    if (auto here = is_here(); !here) return base::pass(here);
    return work(*session_);
  }

  /// Asks the camera whether it is there, without waiting for its answer; a camera that is silent is lost.
  void probe();

  /// Grows with each opening.
  [[nodiscard]] int times_opened() const;

 private:
  using Work = std::function<base::Result<void>(Session&)>;
  struct Job {
    Work work;
    std::optional<base::Result<void>> outcome;
    bool abandoned = false;  // nobody waits any longer
  };

  [[nodiscard]] base::Result<void> run(Work work);
  [[nodiscard]] base::Result<void> is_here() const;
  [[nodiscard]] base::Result<void> silent() const;
  void live();
  void open_session();
  void close_session();
  void do_job(const std::shared_ptr<Job>& job);

  const Open open_;
  const std::string called_;
  const std::chrono::milliseconds answer_;
  const Log log_;

  // Held by whoever uses the session or replaces it, and taken before mutex_.
  TimedMutex use_;
  std::unique_ptr<Session> session_;

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable wake_, done_;
  std::shared_ptr<Job> job_;
  bool ending_ = false;
  bool open_now_ = false;
  bool hopeless_ = false;  // it was there and could not be configured
  int times_opened_ = 0;
  std::optional<base::Error> away_;  // why there is no session
  std::chrono::steady_clock::time_point try_at_{};
  std::thread thread_;
};

}  // namespace rig::drivers::aravis
