#include "tests/structure/include_table.h"

#include <algorithm>
#include <fmt/format.h>
#include <fstream>
#include <functional>
#include <regex>
#include <sstream>
#include <tuple>

namespace rig::structure {

namespace fs = std::filesystem;

namespace {

std::string without_comment(const std::string& line) {
  return line.substr(0, line.find('#'));
}

// The room with the longest name that `path` lies in; empty where none owns it.
std::string room_of(const std::string& path, const RoomTable& rooms) {
  for (fs::path folder = fs::path(path).parent_path(); !folder.empty(); folder = folder.parent_path()) {
    if (rooms.count(folder.generic_string()) != 0) return folder.generic_string();
  }
  return {};
}

bool is_source(const fs::path& path) {
  return path.extension() == ".h" || path.extension() == ".cpp";
}

void check_file(const fs::path& file, const std::string& name, const RoomTable& rooms,
                std::vector<std::string>& faults) {
  const std::string room = room_of(name, rooms);
  if (room.empty()) {
    faults.push_back(fmt::format("{}:1: lies in no room of rooms.txt", name));
    return;
  }
  const std::set<std::string>& allowed = rooms.at(room);
  static const std::regex kInclude(R"re(^\s*#\s*include\s*"([^"]*)")re");
  std::ifstream in(file);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::smatch match;
    if (!std::regex_search(line, match, kInclude)) continue;
    const std::string included = match[1];
    const std::string other = room_of(fs::path(included).lexically_normal().generic_string(), rooms);
    if (other.empty()) {
      faults.push_back(
          fmt::format("{}:{}: \"{}\" is no path from the root into a room", name, number, included));
    } else if (other != room && allowed.count(other) == 0) {
      faults.push_back(
          fmt::format("{}:{}: {} may not include {} (\"{}\")", name, number, room, other, included));
    }
  }
}

}  // namespace

RoomTable read_rooms(const fs::path& file, std::vector<std::string>& faults) {
  RoomTable rooms;
  std::vector<std::tuple<int, std::string>> mentioned;
  std::ifstream in(file);
  if (!in) faults.push_back(fmt::format("{}: cannot be read", file.string()));
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string text = without_comment(line);
    if (text.find_first_not_of(" \t\r") == std::string::npos) continue;
    const auto colon = text.find(':');
    if (colon == std::string::npos) {
      faults.push_back(fmt::format("rooms.txt:{}: has no colon", number));
      continue;
    }
    const auto [room, fresh] = rooms.emplace(text.substr(0, colon), std::set<std::string>());
    if (!fresh) faults.push_back(fmt::format("rooms.txt:{}: {} stands twice", number, room->first));
    std::istringstream words(text.substr(colon + 1));
    for (std::string word; words >> word;) {
      room->second.insert(word);
      mentioned.emplace_back(number, word);
    }
  }
  for (const auto& [number, room] : mentioned) {
    if (rooms.count(room) == 0) faults.push_back(fmt::format("rooms.txt:{}: {} is no room", number, room));
  }
  return rooms;
}

std::vector<std::string> include_faults(const fs::path& root, const RoomTable& rooms) {
  static const std::set<std::string> kFree{"tests", "bench", "build"};
  std::vector<std::string> faults;
  for (const auto& top : fs::directory_iterator(root)) {
    const std::string folder = top.path().filename().string();
    if (!top.is_directory() || folder.starts_with('.') || kFree.count(folder) != 0) continue;
    for (const auto& entry : fs::recursive_directory_iterator(top.path())) {
      if (!entry.is_regular_file() || !is_source(entry.path())) continue;
      check_file(entry.path(), fs::relative(entry.path(), root).generic_string(), rooms, faults);
    }
  }
  std::sort(faults.begin(), faults.end());
  return faults;
}

std::vector<std::string> cycles(const RoomTable& rooms) {
  std::vector<std::string> found;
  std::vector<std::string> chain;
  std::set<std::string> clean;
  const std::function<void(const std::string&)> visit = [&](const std::string& room) {
    if (clean.count(room) != 0) return;
    const auto seen = std::find(chain.begin(), chain.end(), room);
    if (seen != chain.end()) {
      found.push_back(fmt::format("{} > {}", fmt::join(seen, chain.end(), " > "), room));
      return;
    }
    chain.push_back(room);
    const auto uses = rooms.find(room);
    if (uses != rooms.end()) {
      for (const std::string& other : uses->second) visit(other);
    }
    chain.pop_back();
    clean.insert(room);
  };
  for (const auto& [room, uses] : rooms) visit(room);
  return found;
}

}  // namespace rig::structure
