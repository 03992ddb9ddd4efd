// Files that are there whole or not at all, also after a power cut.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace rig::base {

/// The whole content of a file.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// Replaces `path` by `bytes`: written beside it as `<path>.part`, flushed, renamed, the folder flushed.
/// After a crash at any instant `path` holds the old content or the new.
[[nodiscard]] Result<void> write_file_durably(const std::filesystem::path& path,
                                              std::span<const std::byte> bytes);
[[nodiscard]] Result<void> write_file_durably(const std::filesystem::path& path, std::string_view text);

/// Writes and flushes a new file without the rename, for a folder that is itself renamed when it is complete.
[[nodiscard]] Result<void> write_and_flush(const std::filesystem::path& path,
                                           std::span<const std::byte> bytes);

/// Flushes the entries of a folder: what was created, renamed or removed in it.
[[nodiscard]] Result<void> flush_folder(const std::filesystem::path& folder);

/// Makes a folder and those above it that are missing, each durably; one that is there already is left alone.
[[nodiscard]] Result<void> make_folder_durably(const std::filesystem::path& folder);

/// Removes a file, or a folder with all that is in it; nothing there is no error, also where it
/// goes meanwhile. Not flushed.
[[nodiscard]] Result<void> remove_tree(const std::filesystem::path& path);

/// As rename_durably, but a folder in the way is kept under the name `from`; true: there was one.
[[nodiscard]] Result<bool> exchange_durably(const std::filesystem::path& from,
                                            const std::filesystem::path& to);

/// Renames a file or folder within one file system, over what is there, and flushes both parent folders. A
/// folder in the way is exchanged atomically and then removed.
[[nodiscard]] Result<void> rename_durably(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace rig::base
