// Whether the folders include only what rooms.txt allows them.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace rig::structure {

/// Room to the rooms it may include, itself not listed.
using RoomTable = std::map<std::string, std::set<std::string>>;

/// Reads rooms.txt: "room: allowed rooms", comments with #. Faults, such as an unknown room on the right or a
/// room that stands twice, are appended to `faults` as "rooms.txt:line: what".
RoomTable read_rooms(const std::filesystem::path& file, std::vector<std::string>& faults);

/// Every #include "..." in a .h or .cpp below `root` that its room may not make, as "file:line: what"; also
/// source files that no room owns. The folders tests and bench may include everything; build folders and
/// hidden ones are passed over.
std::vector<std::string> include_faults(const std::filesystem::path& root, const RoomTable& rooms);

/// Rooms that reach themselves through the table, one chain a line.
std::vector<std::string> cycles(const RoomTable& rooms);

}  // namespace rig::structure
