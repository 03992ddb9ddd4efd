// Stored frames for clients elsewhere, in pieces, so that one that broke off is gone on with.
#pragma once

#include <filesystem>

#include "core/base/result.h"
#include "core/scan/journal.h"
#include "protocol/rig.pb.h"

namespace rig::daemon {

/// From the scan's journal, opened by the caller. not_found where the journal has no such frame, or its pose
/// is not committed; bad_input for an offset beyond the file.
[[nodiscard]] base::Result<protocol::FramePiece> read_frame_piece(const std::filesystem::path& scan,
                                                                  const scan::Journal& journal,
                                                                  const protocol::GetFrame& wanted);

}  // namespace rig::daemon
