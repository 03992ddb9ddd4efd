#include "core/base/log.h"

#include <cstdlib>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace rig::base {

namespace {

spdlog::logger& logger() {
  static const auto instance = [] {
    auto made = spdlog::stderr_color_mt("rig");
    made->set_pattern(std::getenv("JOURNAL_STREAM") != nullptr ? "%l: %v" : "%H:%M:%S.%e %^%l%$: %v");
    return made;
  }();
  return *instance;
}

spdlog::level::level_enum translate(LogLevel level) {
  switch (level) {
    case LogLevel::debug:
      return spdlog::level::debug;
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

LogSink& sink() {
  static LogSink instance;
  return instance;
}

}  // namespace

void log_line(LogLevel level, std::string_view message) {
  log_line(level, message, {});
}

void log_line(LogLevel level, std::string_view message, std::span<const LogField> fields) {
  if (sink()) {
    if (logger().should_log(translate(level))) sink()(level, message, fields);
    return;
  }
  logger().log(translate(level), spdlog::string_view_t(message.data(), message.size()));
}

void set_log_level(LogLevel level) {
  logger().set_level(translate(level));
}

void set_log_sink(LogSink to) {
  sink() = std::move(to);
}

}  // namespace rig::base
