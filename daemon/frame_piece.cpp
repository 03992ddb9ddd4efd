#include "daemon/frame_piece.h"

#include <algorithm>
#include <fstream>

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr std::uint64_t kMostAtOnce = 4ULL << 20U;

Result<scan::FrameRecord> record_of(const std::filesystem::path& scan, const scan::Journal& journal,
                                    const protocol::GetFrame& wanted) {
  const auto pose = journal.pose(wanted.row());
  if (!pose) return pass(pose);
  if (*pose) {
    for (const scan::FrameRecord& frame : (*pose)->frames) {
      if (frame.index == static_cast<int>(wanted.index())) return frame;
    }
  }
  return fail(ErrorCode::not_found,
              fmt::format("frame {} of row {} is not committed", wanted.index(), wanted.row()),
              scan.string());
}

}  // namespace

Result<protocol::FramePiece> read_frame_piece(const std::filesystem::path& scan, const scan::Journal& journal,
                                              const protocol::GetFrame& wanted) {
  const auto record = record_of(scan, journal, wanted);
  if (!record) return pass(record);
  const std::filesystem::path path = scan / record->file;
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) return fail(ErrorCode::io, error.message(), path.string());
  if (wanted.offset() > size) {
    return fail(ErrorCode::bad_input,
                fmt::format("the file has {} bytes, asked for is byte {}", size, wanted.offset()),
                path.string());
  }
  const std::uint64_t asked = wanted.length() == 0 ? kMostAtOnce : wanted.length();
  std::string content(std::min({asked, kMostAtOnce, size - wanted.offset()}), '\0');
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(wanted.offset()));
  if (!file.read(content.data(), static_cast<std::streamsize>(content.size())))
    return fail(ErrorCode::io, "cannot be read", path.string());
  protocol::FramePiece piece;
  piece.set_file_bytes(size);
  piece.set_sha256(record->sha256);
  piece.set_offset(wanted.offset());
  piece.set_content(std::move(content));
  return piece;
}

}  // namespace rig::daemon
