// The protocol's messages as lines for a person.
#pragma once

#include <string>

#include "protocol/rig.pb.h"

namespace rig::client {

[[nodiscard]] std::string describe_job(const protocol::JobInfo& job);
/// Several lines, each with its end.
[[nodiscard]] std::string describe_status(const protocol::Status& status);

}  // namespace rig::client
