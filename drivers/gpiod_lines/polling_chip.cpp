#include "drivers/gpiod_lines/polling_chip.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/gpiod_lines/now.h"

namespace rig::drivers::gpiod_lines {

namespace {

class PollingChip final : public LineChip {
 public:
  PollingChip(std::unique_ptr<LineChip> chip, const std::vector<LineRequest>& requests,
              std::chrono::milliseconds every)
      : chip_(std::move(chip)), every_(every), polled_(requests.size()) {
    for (std::size_t i = 0; i < requests.size(); ++i) {
      if (!requests[i].output && !requests[i].edges) polled_[i] = std::make_unique<Polled>();
    }
    thread_ = std::thread([this] { poll(); });
  }
  ~PollingChip() override {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  PollingChip(const PollingChip&) = delete;
  PollingChip& operator=(const PollingChip&) = delete;

  [[nodiscard]] Result<bool> level(std::size_t line) override {
    const std::lock_guard lock(mutex_);
    if (!polled_.at(line)) return chip_->level(line);
    auto level = chip_->level(line);
    if (level) note(*polled_[line], *level);
    return level;
  }

  [[nodiscard]] Result<void> set(std::size_t line, bool active) override {
    const std::lock_guard lock(mutex_);
    return chip_->set(line, active);
  }

  [[nodiscard]] Result<std::vector<Edge>> edges(std::size_t line) override {
    const std::lock_guard lock(mutex_);
    if (!polled_.at(line)) return chip_->edges(line);
    if (failed_) return tl::unexpected<base::Error>(*failed_);
    return std::exchange(polled_[line]->edges, {});
  }

 private:
  struct Polled {
    std::optional<bool> level;
    std::vector<Edge> edges;
  };

  // A level that a look has found: a change is noted, as long as there are fewer than tell anything more.
  static void note(Polled& polled, bool level) {
    const bool changed = polled.level && *polled.level != level;
    polled.level = level;
    if (changed && polled.edges.size() < kEdgeQueue) polled.edges.push_back({level, now_ns()});
  }

  void poll() {
    std::unique_lock lock(mutex_);
    while (!ended_ && !failed_) {
      for (std::size_t i = 0; i < polled_.size() && !failed_; ++i) {
        if (!polled_[i]) continue;
        const auto level = chip_->level(i);
        if (level) {
          note(*polled_[i], *level);
        } else {
          failed_ = level.error();
        }
      }
      wake_.wait_for(lock, every_, [this] { return ended_; });
    }
  }

  const std::unique_ptr<LineChip> chip_;
  const std::chrono::milliseconds every_;
  std::mutex mutex_;  // guards the chip and all below
  std::vector<std::unique_ptr<Polled>> polled_;
  std::optional<base::Error> failed_;
  bool ended_ = false;
  std::condition_variable wake_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<LineChip> poll_inputs(std::unique_ptr<LineChip> chip,
                                      const std::vector<LineRequest>& requests,
                                      std::chrono::milliseconds every) {
  const bool any = std::any_of(requests.begin(), requests.end(),
                               [](const LineRequest& r) { return !r.output && !r.edges; });
  if (!any) return chip;
  return std::make_unique<PollingChip>(std::move(chip), requests, every);
}

}  // namespace rig::drivers::gpiod_lines
