// One line a message to standard error, through spdlog. Under systemd the journal adds the time, so it is
// left out.
#pragma once

#include <fmt/format.h>
#include <string_view>
#include <utility>

namespace rig::base {

enum class LogLevel { debug, info, warning, error };

void log_line(LogLevel level, std::string_view message);
/// Messages below `level` are dropped. The default is info.
void set_log_level(LogLevel level);

template <typename... Args>
void log_debug(fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::debug, fmt::format(format, std::forward<Args>(args)...));
}
template <typename... Args>
void log_info(fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::info, fmt::format(format, std::forward<Args>(args)...));
}
template <typename... Args>
void log_warning(fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::warning, fmt::format(format, std::forward<Args>(args)...));
}
template <typename... Args>
void log_error(fmt::format_string<Args...> format, Args&&... args) {
  log_line(LogLevel::error, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace rig::base
