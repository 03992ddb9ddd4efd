// The module tic_axis, as a shared object, against the Tic of sim/wire.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/conformance/bench.h"
#include "sim/wire/tic.h"

namespace rig::drivers::tic::test {

/// What lies between module and Tic.
class TicWire : public conformance::Wire {
 public:
  /// As the settings of the module have it.
  [[nodiscard]] virtual std::string transport() const = 0;
  /// Whole, with nothing spoilt.
  virtual void heal() = 0;
};

/// A bench of that name, with the Tic on the wire that `lay` makes. Stops are on the wire within
/// `stop_bound`.
[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench_on(
    const std::string& name, const sim::wire::TicWorld& world,
    const std::function<std::unique_ptr<TicWire>(sim::wire::Tic&)>& lay, std::chrono::milliseconds stop_bound,
    const std::string& module_settings = {});

/// At a Unix socket.
[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::tic::test
