#include "daemon/bus_worker.h"

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
    BusWorker worker(*clock);
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

}  // namespace
}  // namespace rig::daemon
