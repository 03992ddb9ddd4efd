// What the simulated devices that are programs share: orders come as lines on standard input.
#pragma once

#include <functional>
#include <string>

namespace rig::sim::wire {

/// Each line on standard input through `obey`, until somebody asks the program to end (base::interrupted());
/// when the orders end the device goes on.
void serve_order_lines(const std::function<void(const std::string& line)>& obey);

}  // namespace rig::sim::wire
