#include "daemon/service_manager.h"

#include <cstdint>
#include <cstring>
#include <systemd/sd-daemon.h>

#include "core/base/log.h"

namespace rig::daemon {

namespace {

void notify(const std::string& text) {
  if (const int sent = ::sd_notify(0, text.c_str()); sent < 0) {
    base::log_warning("the service manager cannot be told '{}': {}", text, std::strerror(-sent));
  }
}

}  // namespace

void notify_ready() {
  notify("READY=1");
}

void notify_stopping() {
  notify("STOPPING=1");
}

void notify_status(const std::string& text) {
  notify("STATUS=" + text);
}

void notify_alive() {
  notify("WATCHDOG=1");
}

std::optional<std::chrono::microseconds> watchdog_period() {
  std::uint64_t period_us = 0;
  const int asked = ::sd_watchdog_enabled(0, &period_us);
  if (asked < 0) base::log_warning("the watchdog's period cannot be read: {}", std::strerror(-asked));
  if (asked <= 0) return std::nullopt;
  return std::chrono::microseconds(period_us);
}

}  // namespace rig::daemon
