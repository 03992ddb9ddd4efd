#include "daemon/bus_worker.h"

#include <atomic>
#include <future>
#include <gtest/gtest.h>
#include <string>

namespace rig::daemon {
namespace {

// Holds the worker in its first transaction until `body` has queued everything.
template <typename Body>
std::string order_of(Body&& body) {
  const auto clock = base::make_system_clock();
  std::string order;
  {
    // Outlive the worker, which may still look at them while it ends.
    std::promise<void> started;
    std::promise<void> go;
    BusWorker worker(*clock, "worker");
    worker.queue([&] {
      started.set_value();
      go.get_future().wait();
    });
    started.get_future().wait();
    body(worker, order);
    go.set_value();
  }
  return order;
}

TEST(BusWorker, CarriesOutInOrderAndEverythingBeforeItEnds) {
  EXPECT_EQ(order_of([](BusWorker& worker, std::string& order) {
              for (const char c : std::string("abcdef")) worker.queue([&order, c] { order += c; });
            }),
            "abcdef");
}

TEST(BusWorker, PutsAStopAheadOfAllThatIsQueued) {
  EXPECT_EQ(order_of([](BusWorker& worker, std::string& order) {
              worker.queue([&order] { order += 'a'; });
              worker.queue([&order] { order += 'b'; });
              worker.queue_first([&order] { order += 'S'; });
              worker.queue([&order] { order += 'c'; });
            }),
            "Sabc");
}

TEST(BusWorker, AStopDropsWhatIsQueuedOfItsGroupAlone) {
  EXPECT_EQ(order_of([](BusWorker& worker, std::string& order) {
              worker.queue([&order] { order += 'm'; }, 1);
              worker.queue([&order] { order += 'n'; }, 2);
              worker.queue([&order] { order += 'p'; });
              worker.queue_first([&order] { order += 'S'; }, 1);
              worker.queue([&order] { order += 'q'; }, 1);
            }),
            "Snpq");
}

// A clock that the test moves on while a transaction is in flight.
class MovedClock final : public base::Clock {
 public:
  [[nodiscard]] base::Time now() const override { return base::Time(base::Duration(now_.load())); }
  bool wait(base::WaitSlot& slot, std::optional<base::Time>, base::WaitFor kind) override {
    return real_->wait(slot, std::nullopt, kind);
  }
  void notify(base::WaitSlot& slot) override { real_->notify(slot); }
  void join() override {}
  void leave() override {}
  void not_before(base::Time) override {}
  void pass(double s) { now_ += base::seconds(s).count(); }

 private:
  std::unique_ptr<base::Clock> real_ = base::make_system_clock();
  std::atomic<base::Duration::rep> now_{0};
};

TEST(BusWorker, TellsOnceOfATransactionThatOutlastsItsBound) {
  MovedClock clock;
  BusWorker worker(clock, "worker");
  std::promise<void> started;
  std::promise<void> go;
  worker.queue(
      [&] {
        started.set_value();
        go.get_future().wait();
      },
      0, {"axis pan: a reading", base::seconds(1)});
  started.get_future().wait();
  clock.pass(1);
  EXPECT_FALSE(worker.overdue().has_value());
  clock.pass(0.1);
  EXPECT_EQ(worker.overdue(), "axis pan: a reading took longer than 1 s");  // while it hangs
  EXPECT_FALSE(worker.overdue().has_value());
  go.set_value();
  std::promise<void> done;
  worker.queue([&] { done.set_value(); });
  done.get_future().wait();
  EXPECT_FALSE(worker.overdue().has_value());
}

TEST(BusWorker, TellsOfATransactionThatCameBackLate) {
  MovedClock clock;
  BusWorker worker(clock, "worker");
  worker.queue([&] { clock.pass(3); }, 1, {"axis pan: a command", base::seconds(2)});
  worker.queue([&] { clock.pass(3); });  // has no bound
  worker.queue_first([&] { clock.pass(1.5); }, 2, {"axis pan: a stop", base::seconds(2)});
  std::promise<void> done;
  worker.queue([&] { done.set_value(); });
  done.get_future().wait();
  EXPECT_EQ(worker.overdue(), "axis pan: a command took longer than 2 s");
  EXPECT_FALSE(worker.overdue().has_value());
}

}  // namespace
}  // namespace rig::daemon
