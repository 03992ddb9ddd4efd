// A scan on disk (docs/file-formats.md): job.toml and rig.toml as used, journal.sqlite,
// frames/<row>/<index>.tif.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/machine/job_config.h"
#include "core/machine/rig_config.h"
#include "core/scan/frame_file.h"
#include "core/scan/journal.h"

namespace rig::scan {

/// Version of the layout; a reader refuses greater ones.
inline constexpr int kScanFormat = 1;

/// Names of what is inside; no I/O.
[[nodiscard]] std::filesystem::path journal_path(const std::filesystem::path& scan);
[[nodiscard]] std::filesystem::path frames_folder(const std::filesystem::path& scan, std::int64_t row);
[[nodiscard]] std::filesystem::path part_folder(const std::filesystem::path& scan, std::int64_t row);
/// "00.tif" for index 0.
[[nodiscard]] std::string frame_name(int index);

/// Whether a file system with this number (statfs) is a network's: NFS, SMB in each of its versions, AFS,
/// Ceph; FUSE, behind which there may be one.
[[nodiscard]] bool is_network_file_system(unsigned long magic);

/// An Error where a folder is on a network file system: locks and flushes of a journal do not hold there.
[[nodiscard]] base::Result<void> refuse_network_disk(const std::filesystem::path& folder);

/// Makes a new scan: the folder (which must not exist, or be empty), both files as given, the journal with
/// the plan of the job. Nothing is left behind where it fails.
[[nodiscard]] base::Result<void> create_scan(const std::filesystem::path& scan, const std::string& rig_toml,
                                             const std::string& job_toml);

/// A scan opened for reading.
struct ScanView {
  std::filesystem::path folder;
  machine::RigConfig rig;
  machine::JobConfig job;
  std::vector<PoseRecord> poses;  ///< the done ones, by row
  std::vector<PlanRow> plan;
};
[[nodiscard]] base::Result<ScanView> open_scan(const std::filesystem::path& scan);

/// Writes one frame, flushed, into the part folder of its row, which is made if needed; returns its SHA-256.
[[nodiscard]] base::Result<std::string> store_frame(const std::filesystem::path& scan,
                                                    const FrameFacts& facts, int width, int height,
                                                    const std::uint16_t* pixels);

/// Renames the part folder of a complete bracket to its final name, durably. An older take of the same row is
/// kept under the name of the part folder: discard_bracket() removes it once the journal knows the new one.
[[nodiscard]] base::Result<void> publish_bracket(const std::filesystem::path& scan, std::int64_t row);

/// Removes a partial bracket, if there is one.
[[nodiscard]] base::Result<void> discard_bracket(const std::filesystem::path& scan, std::int64_t row);

/// Whether a folder holds the frames of a pose with the bytes that its record names.
[[nodiscard]] bool holds_bracket(const std::filesystem::path& folder, const PoseRecord& pose);

/// Brings the folder to the state of the journal after a crash: partial brackets removed, published brackets
/// that the journal does not know removed too (their pose is retaken whole), and a take that the journal
/// knows brought back where a retake of it was published and not committed.
[[nodiscard]] base::Result<void> tidy_scan(const std::filesystem::path& scan, const Journal& journal);

}  // namespace rig::scan
