// One line a message to standard error, through spdlog, or wherever a program sends its records instead.
// Where standard error goes to systemd's journal, that adds the time, so it is left out.
#pragma once

#include <fmt/format.h>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace rig::base {

enum class LogLevel { debug, info, warning, error };

/// What a message is about, for those who search a log: ("RIG_ROW", "17"). Capitals, digits and underscores.
struct LogField {
  std::string name;
  std::string value;
};

void log_line(LogLevel level, std::string_view message);
/// The fields are for a sink that keeps them; a plain line is the message alone.
void log_line(LogLevel level, std::string_view message, std::span<const LogField> fields);
/// Messages below `level` are dropped. The default is info.
void set_log_level(LogLevel level);

/// Takes the records in place of standard error; called from any thread. Set once, before there are threads.
using LogSink = std::function<void(LogLevel, std::string_view message, std::span<const LogField>)>;
void set_log_sink(LogSink sink);

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
