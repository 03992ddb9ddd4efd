#include "clients/rig/dispatch.h"

#include <cstdlib>
#include <set>
#include <sstream>
#include <unistd.h>

namespace rig::client {

namespace fs = std::filesystem;

namespace {

constexpr const char* kPrefix = "rig-";

bool is_program(const fs::path& file) {
  std::error_code absent;
  return fs::is_regular_file(file, absent) && ::access(file.c_str(), X_OK) == 0;
}

std::vector<fs::path> folders() {
  std::vector<fs::path> out;
  std::error_code error;
  if (const fs::path self = fs::read_symlink("/proc/self/exe", error); !error)
    out.push_back(self.parent_path());
  const char* path = std::getenv("PATH");
  std::istringstream parts(path != nullptr ? path : "");
  for (std::string part; std::getline(parts, part, ':');) {
    if (!part.empty()) out.emplace_back(part);
  }
  return out;
}

}  // namespace

std::optional<fs::path> find_program(const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos) return std::nullopt;
  for (const fs::path& folder : folders()) {
    const fs::path candidate = folder / (kPrefix + name);
    if (is_program(candidate)) return candidate;
  }
  return std::nullopt;
}

std::vector<std::string> programs() {
  std::set<std::string> names;
  for (const fs::path& folder : folders()) {
    std::error_code unreadable_is_empty;
    for (const auto& entry : fs::directory_iterator(folder, unreadable_is_empty)) {
      const std::string file = entry.path().filename().string();
      if (file.rfind(kPrefix, 0) == 0 && is_program(entry.path())) {
        names.insert(file.substr(std::string(kPrefix).size()));
      }
    }
  }
  return {names.begin(), names.end()};
}

}  // namespace rig::client
