// `rig X` runs the program `rig-X`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace rig::client {

/// The program `rig-<name>` beside the running one, or on PATH.
[[nodiscard]] std::optional<std::filesystem::path> find_program(const std::string& name);

/// Names X of every `rig-X` that can be found, sorted.
[[nodiscard]] std::vector<std::string> programs();

}  // namespace rig::client
