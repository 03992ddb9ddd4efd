// What rigd tells systemd about itself. Without a service manager ($NOTIFY_SOCKET) all of it does nothing.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace rig::daemon {

/// rigd listens and its devices are open.
void notify_ready();
/// rigd is ending as it was asked to.
void notify_stopping();
/// One line for `systemctl status`.
void notify_status(const std::string& text);
/// The watchdog is fed.
void notify_alive();

/// How often the service manager wants to be fed ($WATCHDOG_USEC, for this process); nothing where it does
/// not.
[[nodiscard]] std::optional<std::chrono::microseconds> watchdog_period();

}  // namespace rig::daemon
