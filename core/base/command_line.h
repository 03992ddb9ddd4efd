// The one way in which every program takes its command line: wrong usage is exit status 2.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

namespace rig::base {

inline constexpr int kWrongUsage = 2;

/// Parses; where the program must end now (wrong usage, --help) the exit status to end with, the text
/// printed.
[[nodiscard]] inline std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  }
  return std::nullopt;
}

}  // namespace rig::base
