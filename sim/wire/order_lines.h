// What the simulated devices that are programs share: orders come as lines on standard input, and each is
// answered by a line on standard output.
#pragma once

#include <functional>
#include <string>

#include "core/base/result.h"

namespace rig::sim::wire {

/// A device that can be plugged in and pulled out, and its orders in words.
struct OrderedDevice {
  std::string program;  ///< whose complaints go to standard error
  std::function<base::Result<void>()> plug;
  std::function<void()> unplug;
  std::function<base::Result<std::string>(const std::string& order)> carry_out;
};

/// Does "plug", "unplug" or what carry_out knows. The answer: its text, "ok" for an empty one, "refused"
/// where it failed, and why goes to standard error.
[[nodiscard]] std::string obey_order(const OrderedDevice& device, const std::string& order);

/// Plugs it in, says "ready", and obeys until somebody asks the program to end (base::interrupted()); when
/// the orders end the device goes on. The program's exit status: 1 where it cannot be plugged in.
[[nodiscard]] int serve_order_lines(const OrderedDevice& device);

/// Says on standard error what is wrong, after the program's name.
void complain_of(const std::string& program, const base::Error& error);

}  // namespace rig::sim::wire
