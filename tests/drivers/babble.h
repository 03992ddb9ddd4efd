// A line on which somebody never stops to speak.
#pragma once

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "sim/wire/pty.h"

namespace rig::test {

/// For as long as it lives. What it says is no part of any answer.
class Babble {
 public:
  explicit Babble(sim::wire::Pty& line, std::string what = "x",
                  std::chrono::microseconds every = std::chrono::microseconds(200))
      : thread_([this, &line, what = std::move(what), every] {
          while (!ends_) {
            line.write(what);
            std::this_thread::sleep_for(every);
          }
        }) {}
  ~Babble() {
    ends_ = true;
    thread_.join();
  }
  Babble(const Babble&) = delete;
  Babble& operator=(const Babble&) = delete;

 private:
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace rig::test
