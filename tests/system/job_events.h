// What a scan's journal and rigd's own state keep of a job's events.
#pragma once

#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "core/scan/journal.h"
#include "core/scan/scan_directory.h"
#include "protocol/rig.pb.h"

namespace rig::test {

/// The events in the journal of a scan.
inline std::vector<protocol::Event> events_in_journal(const std::filesystem::path& scan) {
  std::vector<protocol::Event> events;
  const auto journal = scan::Journal::open_read_only(scan::journal_path(scan));
  EXPECT_TRUE(journal.has_value()) << journal.error().text();
  if (!journal) return events;
  const auto records = journal->events_after(0, 0, 1000000);
  EXPECT_TRUE(records.has_value()) << records.error().text();
  for (const scan::EventRecord& record : *records) {
    protocol::Event event;
    EXPECT_TRUE(event.ParseFromString(record.payload));
    events.push_back(std::move(event));
  }
  return events;
}

/// The reasons that the journal has: of poses that failed, of suspensions, of bad visits.
inline std::vector<std::string> reasons_in_journal(const std::filesystem::path& scan) {
  std::vector<std::string> reasons;
  for (const protocol::Event& event : events_in_journal(scan)) {
    if (event.has_pose_failed()) reasons.push_back(event.pose_failed().reason());
    if (event.has_job_suspended()) reasons.push_back(event.job_suspended().reason());
    if (event.has_reference_visited() && !event.reference_visited().good())
      reasons.push_back(event.reference_visited().what());
  }
  return reasons;
}

}  // namespace rig::test
