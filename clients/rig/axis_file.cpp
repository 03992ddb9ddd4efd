#include "clients/rig/axis_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

#include "core/base/config_edit.h"
#include "core/base/files.h"
#include "core/machine/rig_config.h"

namespace rig::client {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr base::Range kAnything{-1e12, 1e12};
// Names for the second and more backups of one second.
constexpr int kMostBackups = 100;

// The settings are the module's: only what is there is looked at.
void read_settings(const base::ConfigTable& settings, AxisFile& file) {
  const auto axes = settings.table_if("axis");
  const auto table = axes ? axes->table_if(file.device) : std::nullopt;
  if (!table) return;
  if (table->has("reversed")) file.reversed = table->boolean_or("reversed", false);
  if (table->has("counts_per_deg")) file.counts_per_deg = table->number("counts_per_deg", kAnything);
}

std::string date_time() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  ::localtime_r(&now, &local);
  std::array<char, 32> out{};
  const std::size_t length = std::strftime(out.data(), out.size(), "%Y%m%d-%H%M%S", &local);
  return {out.data(), length};
}

tl::unexpected<base::Error> system_failure(const std::string& what, const fs::path& path, int error) {
  return fail(ErrorCode::io, fmt::format("cannot {}: {}", what, std::strerror(error)), path.string());
}

// A second name for the old content, which stays when the first one is given to the new: a link never
// overwrites.
Result<fs::path> keep_old(const fs::path& path) {
  const std::string name = path.string() + ".bak-" + date_time();
  for (int i = 1; i <= kMostBackups; ++i) {
    const std::string candidate = i == 1 ? name : fmt::format("{}-{}", name, i);
    if (::link(path.c_str(), candidate.c_str()) == 0) {
      if (auto ok = base::flush_folder(path.parent_path()); !ok) return pass(ok);
      return fs::path(candidate);
    }
    if (errno != EEXIST) return system_failure("keep the old file as", candidate, errno);
  }
  return system_failure("keep the old file as", name, EEXIST);
}

}  // namespace

Result<AxisFile> read_axis_file(const std::string& text, const std::string& name, const std::string& axis) {
  const auto rig = machine::parse_rig_config(text, name);
  if (!rig) return pass(rig);
  const auto found = std::find(machine::kAxisNames.begin(), machine::kAxisNames.end(), axis);
  if (found == machine::kAxisNames.end())
    return fail(ErrorCode::bad_input, fmt::format("there is no axis '{}'", axis), {},
                "roll, tilt, pan or arm");
  const auto index = static_cast<std::size_t>(found - machine::kAxisNames.begin());
  const auto& config = rig->axes.at(index);
  AxisFile file;
  file.rig = rig->name;
  file.axis = axis;
  file.module = config.device.module;
  file.device = config.device.device;
  file.limit_lines = rig->lines.limit.at(index);
  // Not from `config`: a number that was turned into radians and back may be another.
  const auto root = base::ConfigTable::parse(text, name);
  if (!root) return pass(root);
  const auto table = root->table("axis").table(axis);
  file.min_deg = table.number("min_deg", kAnything);
  file.max_deg = table.number("max_deg", kAnything);
  file.home_deg = table.number("home_deg", kAnything);
  file.tolerance_deg = table.number("tolerance_deg", kAnything);
  file.approach_deg = table.number_or("approach_deg", 0, kAnything);
  for (const auto& module : root->tables("module")) {
    if (module.text("name") == file.module) read_settings(module.table("settings"), file);
  }
  if (auto ok = root->noted(); !ok) return pass(ok);
  return file;
}

Result<std::string> with_changes(const std::string& text, const AxisFile& file, const AxisChanges& changes) {
  Result<std::string> out = text;
  const auto set = [&](std::vector<std::string> path, const char* key, const auto& value) {
    if (!value || !out) return;
    path.emplace_back(key);
    out = base::edit_toml_value(*out, path, *value);
  };
  const std::vector<std::string> axis{"axis", file.axis};
  const std::vector<std::string> settings{"module", "name=" + file.module, "settings", "axis", file.device};
  set(settings, "reversed", changes.reversed);
  set(settings, "counts_per_deg", changes.counts_per_deg);
  set(axis, "min_deg", changes.min_deg);
  set(axis, "max_deg", changes.max_deg);
  set(axis, "home_deg", changes.home_deg);
  return out;
}

Result<fs::path> replace_keeping_old(const fs::path& path, const std::string& read, const std::string& text) {
  // Where it is a link, what it leads to is replaced.
  std::error_code error;
  const fs::path file = fs::canonical(path, error);
  if (error) return fail(ErrorCode::not_found, error.message(), path.string());
  const auto now = base::read_file(file);
  if (!now) return pass(now);
  if (*now != read)
    return fail(ErrorCode::busy, "somebody has changed it meanwhile", file.string(), "begin again");
  struct stat before {};
  if (::stat(file.c_str(), &before) != 0) return system_failure("look at", file, errno);
  auto old = keep_old(file);
  if (!old) return old;
  if (auto ok = base::write_file_durably(file, text); !ok) return pass(ok);
  // Ownership first: changing it may take permissions away.
  if (::chown(file.c_str(), before.st_uid, before.st_gid) != 0)
    return system_failure("give its owner back to", file, errno);
  if (::chmod(file.c_str(), before.st_mode & 07777) != 0)
    return system_failure("give its permissions back to", file, errno);
  return old;
}

}  // namespace rig::client
