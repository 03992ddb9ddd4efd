// The morning report for people and for programs.
#pragma once

#include <string>

#include "core/base/result.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

/// For a person: what matters first, then every pose that was not simply done.
[[nodiscard]] std::string report_text(const Report& report);

/// The message as JSON, every field of it.
[[nodiscard]] base::Result<std::string> report_json(const Report& report);

}  // namespace rig::protocol
