#include "drivers/aravis_camera/keeper.h"

namespace rig::drivers::aravis {

using base::ErrorCode;
using base::fail;
using base::LogLevel;
using base::Result;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

namespace {

constexpr milliseconds kTryAgain{1000};

}  // namespace

Keeper::Keeper(Open open, std::string called, milliseconds answer, Log log)
    : open_(std::move(open)), called_(std::move(called)), answer_(answer), log_(std::move(log)) {
  thread_ = std::thread([this] { live(); });
}

Keeper::~Keeper() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

Result<CameraCapabilities> Keeper::wait_until_open(milliseconds within) {
  {
    std::unique_lock lock(mutex_);
    (void)done_.wait_for(lock, within, [&] { return open_now_ || hopeless_; });
    if (!open_now_ && away_) return tl::unexpected<base::Error>(*away_);
    if (!open_now_) {
      return fail(ErrorCode::lost, fmt::format("it does not open within {} ms", within.count()), called_);
    }
  }
  return look<CameraCapabilities>([](Session& s) -> Result<CameraCapabilities> { return s.capabilities(); });
}

int Keeper::times_opened() const {
  const std::lock_guard lock(mutex_);
  return times_opened_;
}

Result<void> Keeper::silent() const {
  return fail(ErrorCode::lost, fmt::format("no answer within {} ms", answer_.count()), called_);
}

Result<void> Keeper::is_here() const {
  const std::lock_guard lock(mutex_);
  if (open_now_ && session_ && !session_->is_lost()) return {};
  if (away_) return tl::unexpected<base::Error>(*away_);
  return fail(ErrorCode::lost, "it is gone, or another program controls it", called_);
}

Result<void> Keeper::run(Work work) {
  auto job = std::make_shared<Job>();
  job->work = std::move(work);
  const auto until = Steady::now() + answer_;
  std::unique_lock lock(mutex_);
  // Only a probe, or a call that was given up, can be before this one.
  if (!done_.wait_until(lock, until, [&] { return !job_ || !open_now_; })) return silent();
  if (!open_now_) {
    if (away_) return tl::unexpected<base::Error>(*away_);
    return fail(ErrorCode::lost, "it is away", called_);
  }
  job_ = job;
  wake_.notify_all();
  if (!done_.wait_until(lock, until, [&] { return job->outcome.has_value(); })) {
    job->abandoned = true;
    return silent();
  }
  return *job->outcome;
}

void Keeper::probe() {
  const std::lock_guard lock(mutex_);
  if (job_ || !open_now_) return;
  job_ = std::make_shared<Job>();
  job_->work = [](Session& session) { return session.answer(); };
  wake_.notify_all();
}

void Keeper::live() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (job_) {
      const auto job = job_;
      lock.unlock();
      do_job(job);
      lock.lock();
      job_.reset();
      done_.notify_all();
    } else if (open_now_ && session_->is_lost()) {
      lock.unlock();
      close_session();
      lock.lock();
    } else if (!open_now_ && Steady::now() >= try_at_) {
      lock.unlock();
      open_session();
      lock.lock();
      done_.notify_all();
    } else if (open_now_) {
      wake_.wait(lock);
    } else {
      wake_.wait_until(lock, try_at_);
    }
  }
  lock.unlock();
  const std::lock_guard use(use_);
  session_.reset();
}

void Keeper::open_session() {
  auto opened = open_([this] {
    // Through the mutex: else it could fall between the keeper's look and its sleep.
    const std::lock_guard lock(mutex_);
    wake_.notify_all();
  });
  const std::lock_guard use(use_);
  const std::lock_guard lock(mutex_);
  try_at_ = Steady::now() + kTryAgain;
  if (!opened) {
    // Said once: it is tried every second.
    if (!away_ || away_->what != opened.error().what) log_(LogLevel::debug, opened.error().text());
    hopeless_ = times_opened_ == 0 && opened.error().code != ErrorCode::lost;
    away_ = opened.error();
    away_->code = ErrorCode::lost;
    return;
  }
  session_ = std::move(*opened);
  if (times_opened_ > 0) log_(LogLevel::info, called_ + ": it is back");
  ++times_opened_;
  open_now_ = true;
  away_.reset();
}

void Keeper::close_session() {
  const std::lock_guard use(use_);
  std::unique_lock lock(mutex_);
  open_now_ = false;
  try_at_ = Steady::now();
  if (!away_) away_ = base::Error{ErrorCode::lost, "it is gone, or another program controls it", called_, {}};
  log_(LogLevel::warning, away_->text());
  lock.unlock();
  // Of a camera that is gone this takes seconds: Aravis wants to say goodbye.
  session_.reset();
}

void Keeper::do_job(const std::shared_ptr<Job>& job) {
  Result<void> outcome;
  {
    const std::lock_guard use(use_);
    if (auto here = is_here(); !here) {
      outcome = here;
    } else {
      outcome = job->work(*session_);
    }
  }
  bool close = false;
  {
    const std::lock_guard lock(mutex_);
    const bool is_away = !outcome && outcome.error().code == ErrorCode::lost;
    // What a call that was given up did at last is not known to whoever made it.
    close = open_now_ && (is_away || job->abandoned);
    if (close && is_away) away_ = outcome.error();
    if (close && !is_away) away_ = silent().error();
    if (close) open_now_ = false;
    if (close) session_->give_up();
    job->outcome = std::move(outcome);
  }
  done_.notify_all();
  if (close) close_session();
}

}  // namespace rig::drivers::aravis
