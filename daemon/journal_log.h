// The log of rigd in systemd's journal, with its fields.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/log.h"

namespace rig::daemon {

/// Whether the file descriptor is the stream that `journal_stream` ("device:inode", what systemd sets in
/// $JOURNAL_STREAM) names: not so where the output was redirected, or the variable inherited.
[[nodiscard]] bool goes_to_journal(int fd, const char* journal_stream);

/// A record as the journal takes it, "NAME=value" each: MESSAGE, PRIORITY, SYSLOG_IDENTIFIER, then the
/// fields.
[[nodiscard]] std::vector<std::string> journal_entry(base::LogLevel level, std::string_view message,
                                                     std::span<const base::LogField> fields,
                                                     const std::string& program);

/// From here on records go to the journal with their fields, if standard error goes there. Else nothing
/// changes.
void log_to_journal(const std::string& program);

}  // namespace rig::daemon
