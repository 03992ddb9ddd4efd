// The reference visits of a scan: its dark frames and those of the reference patches, as the journal keeps
// them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "core/scan/frame_file.h"
#include "core/scan/sqlite.h"

namespace rig::scan {

/// One frame of a visit.
struct LookRecord {
  std::string name;  ///< "dark", "patches"
  std::string file;  ///< relative to the scan directory: "references/000002/dark.tif"
  double exposure_s = 0;
  base::Time started{};
  std::string sha256;
  std::vector<double>
      means_dn;  ///< above black: of the whole frame (dark), of each patch in rig.toml's order
};

struct VisitRecord {
  std::int64_t number = 0;  ///< from 0
  base::Time when{};
  bool good = false;
  /// What is wrong. Of a good one: why the scan was begun anew with it. Empty where it is not good: unproven,
  /// nothing is wrong with it, but there was none yet to compare it with.
  std::string what;
  std::vector<LookRecord> looks;

  [[nodiscard]] bool unproven() const { return !good && what.empty(); }
};

/// Which committed poses a visit makes pending again.
enum class Retake { none, since_good, all };

/// What a job that goes on has to know of the visits so far.
struct VisitsSoFar {
  std::int64_t next = 0;  ///< number of the next one
  /// The standard, which all others are compared with: the last good one before the first pose that is
  /// committed, or the first good one, where a pose came before it. None: there is no good one.
  std::optional<VisitRecord> first;
  int agreed = 0;                       ///< good ones from `first` on
  std::vector<VisitRecord> since_good;  ///< those after the last good one
  base::Time last_good{};               ///< epoch of the clock: none
  std::int64_t poses_since_good = 0;    ///< committed after it
};

/// Names of what is inside; no I/O.
[[nodiscard]] std::filesystem::path visit_folder(const std::filesystem::path& scan, std::int64_t number);
[[nodiscard]] std::filesystem::path visit_part_folder(const std::filesystem::path& scan, std::int64_t number);

/// Writes the frame of a look, flushed, into the part folder of its visit; returns its SHA-256.
[[nodiscard]] base::Result<std::string> store_look(const std::filesystem::path& scan, std::int64_t number,
                                                   const std::string& name, const FrameFacts& facts,
                                                   int width, int height, const std::uint16_t* pixels);
/// Renames the part folder of a visit whose looks are all stored, durably.
[[nodiscard]] base::Result<void> publish_visit(const std::filesystem::path& scan, std::int64_t number);

// For the journal alone, inside its transactions.

[[nodiscard]] base::Result<void> make_visit_tables(const Database& database);
[[nodiscard]] base::Result<void> insert_visit(const Database& database, const VisitRecord& visit);
/// All of them, by number; none where the journal is of a version before visits.
[[nodiscard]] base::Result<std::vector<VisitRecord>> read_visits(const Database& database);

}  // namespace rig::scan
