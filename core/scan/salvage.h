// What can still be read of a damaged journal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "core/base/result.h"
#include "core/scan/journal.h"

namespace rig::scan {

struct Salvage {
  std::map<std::int64_t, PlanRow> rows;
  std::map<std::int64_t, PoseRecord> poses;
  std::vector<EventRecord> events;
  std::vector<VisitRecord> visits;  ///< all of them or none
};

/// Reads rows 0 to `rows` - 1 one by one; what is damaged is left out. Works on a copy: neither the file nor
/// its log are changed. An Error only where the copy cannot be made or a newer version wrote the file.
[[nodiscard]] base::Result<Salvage> salvage_journal(const std::filesystem::path& journal, std::int64_t rows);

}  // namespace rig::scan
