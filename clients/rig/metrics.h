// rigd's metrics, for a person and for other programs.
#pragma once

#include <string>

#include "clients/rig/commands.h"
#include "protocol/rig.pb.h"

namespace rig::client {

enum class MetricsFormat { text, json, prometheus };

[[nodiscard]] Result<void> metrics(const Connection& to, MetricsFormat format);

/// `text`: a line each, name and value. `json`: one object, a metric of a bus under the bus's name.
/// `prometheus`: the text exposition format 0.0.4.
[[nodiscard]] std::string describe_metrics(const protocol::Metrics& metrics, MetricsFormat format);

}  // namespace rig::client
