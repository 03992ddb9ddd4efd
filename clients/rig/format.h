// The protocol's messages as lines for a person.
#pragma once

#include <string>

#include "protocol/rig.pb.h"

namespace rig::client {

[[nodiscard]] std::string describe_job(const protocol::JobInfo& job);
/// Without the folder and the reason, which are long.
[[nodiscard]] std::string describe_job_shortly(const protocol::JobInfo& job);
/// "running a job", "stopped: emergency stop".
[[nodiscard]] std::string describe_mode(const protocol::Status& status);
[[nodiscard]] std::string describe_light(const protocol::LightStatus& light);
/// What a job would take, and its problems; several lines, each with its end.
/// What keeps a job from going on, for how long already, and how long it may; without the reason.
[[nodiscard]] std::string describe_suspension(const protocol::Suspension& suspension);
/// "12.3 GB", "45.6 MB".
[[nodiscard]] std::string describe_bytes(double bytes);
[[nodiscard]] std::string describe_preflight(const protocol::Preflight& flight);
/// What there is to say of an axis beside where it stands, each after a comma: limit switches, its fault.
[[nodiscard]] std::string describe_trouble(const protocol::AxisStatus& axis);
/// Several lines, each with its end.
[[nodiscard]] std::string describe_status(const protocol::Status& status);

/// Who holds control of the rig, and the other clients, one a line.
[[nodiscard]] std::string describe_control(const protocol::Control& control);

}  // namespace rig::client
