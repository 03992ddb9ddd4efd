#include "daemon/journal_log.h"

#include <cstdio>
#include <cstdlib>
#include <sys/stat.h>
#include <sys/uio.h>
#include <syslog.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

namespace rig::daemon {

namespace {

int priority_of(base::LogLevel level) {
  switch (level) {
    case base::LogLevel::debug:
      return LOG_DEBUG;
    case base::LogLevel::info:
      return LOG_INFO;
    case base::LogLevel::warning:
      return LOG_WARNING;
    case base::LogLevel::error:
      return LOG_ERR;
  }
  return LOG_ERR;
}

}  // namespace

bool goes_to_journal(int fd, const char* journal_stream) {
  struct stat is {};
  if (journal_stream == nullptr || ::fstat(fd, &is) != 0) return false;
  return journal_stream == fmt::format("{}:{}", is.st_dev, is.st_ino);
}

std::vector<std::string> journal_entry(base::LogLevel level, std::string_view message,
                                       std::span<const base::LogField> fields, const std::string& program) {
  std::vector<std::string> entry{fmt::format("MESSAGE={}", message),
                                 fmt::format("PRIORITY={}", priority_of(level)),
                                 "SYSLOG_IDENTIFIER=" + program};
  for (const base::LogField& field : fields) entry.push_back(field.name + "=" + field.value);
  return entry;
}

void log_to_journal(const std::string& program) {
  if (!goes_to_journal(STDERR_FILENO, std::getenv("JOURNAL_STREAM"))) return;
  base::set_log_sink(
      [program](base::LogLevel level, std::string_view message, std::span<const base::LogField> fields) {
        std::vector<std::string> entry = journal_entry(level, message, fields, program);
        std::vector<iovec> parts;
        parts.reserve(entry.size());
        for (std::string& part : entry) parts.push_back({part.data(), part.size()});
        if (::sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) < 0) {
          // Standard error still reaches the journal, without the fields.
          std::fprintf(stderr, "<%d>%s\n", priority_of(level), std::string(message).c_str());
        }
      });
}

}  // namespace rig::daemon
