#include "daemon/watchdog.h"

#include <algorithm>

#include "core/base/log.h"
#include "core/base/thread.h"

namespace rig::daemon {

struct Watchdog::Answers {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<bool> awaited;  // by part
  bool ending = false;

  [[nodiscard]] bool all_in() const {
    return std::none_of(awaited.begin(), awaited.end(), [](bool waits) { return waits; });
  }
};

Watchdog::Watchdog(std::vector<WatchedPart> parts, std::chrono::microseconds period,
                   std::function<void()> feed)
    : parts_(std::move(parts)),
      period_(period),
      feed_(std::move(feed)),
      answers_(std::make_shared<Answers>()) {
  answers_->awaited.assign(parts_.size(), false);
  thread_ = std::thread([this] {
    base::name_thread("watchdog");
    run();
  });
}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(answers_->mutex);
    answers_->ending = true;
  }
  answers_->changed.notify_all();
  thread_.join();
}

void Watchdog::ask_those_that_answered() {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    {
      const std::lock_guard lock(answers_->mutex);
      if (answers_->awaited[i]) continue;  // a blocked part's queue does not fill with questions
      answers_->awaited[i] = true;
    }
    parts_[i].ask([answers = answers_, i] {
      {
        const std::lock_guard lock(answers->mutex);
        answers->awaited[i] = false;
      }
      answers->changed.notify_all();
    });
  }
}

std::string Watchdog::silent() const {
  std::string names;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (answers_->awaited[i]) names += (names.empty() ? "" : ", ") + parts_[i].name;
  }
  return names;
}

void Watchdog::run() {
  const auto ended = [this] { return answers_->ending; };
  const auto answered = [this] { return answers_->ending || answers_->all_in(); };
  while (true) {
    const auto next = std::chrono::steady_clock::now() + period_ / 2;
    ask_those_that_answered();
    std::unique_lock lock(answers_->mutex);
    if (!answers_->changed.wait_for(lock, period_, answered)) {
      base::log_error("watchdog: no answer from {} in {} s; the service manager is not told that rigd lives",
                      silent(), std::chrono::duration<double>(period_).count());
      answers_->changed.wait(lock, answered);
    }
    if (answers_->ending) return;
    lock.unlock();
    feed_();
    lock.lock();
    if (answers_->changed.wait_until(lock, next, ended)) return;
  }
}

}  // namespace rig::daemon
