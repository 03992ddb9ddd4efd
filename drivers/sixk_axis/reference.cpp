#include "drivers/sixk_axis/reference.h"

#include "core/base/files.h"

namespace rig::drivers::sixk {

Reference::Reference(const std::filesystem::path& folder, const std::string& axis, Log log)
    : file_(folder / (axis + ".unreferenced")), log_(log) {
  std::error_code error;
  // What cannot be looked at is not believed either.
  lost_ = std::filesystem::exists(file_, error) || error;
}

void Reference::tell(const std::string& what) const {
  log_(base::LogLevel::warning, fmt::format("{}: {}", file_.string(), what));
}

void Reference::lose(const std::string& why) {
  if (lost_) return;
  lost_ = true;
  if (auto ok = base::write_file_durably(file_, why + "\n"); !ok) {
    tell(fmt::format("that the axis has to be homed ({}) is forgotten with this process: {}", why,
                     ok.error().text()));
  }
}

void Reference::found() {
  if (!lost_) return;
  std::error_code error;
  std::filesystem::remove(file_, error);
  if (error) {
    tell(fmt::format("cannot be removed, and the axis has to be homed after a restart: {}", error.message()));
  } else if (auto ok = base::flush_folder(file_.parent_path()); !ok) {
    tell(ok.error().text());
  }
  lost_ = false;
}

}  // namespace rig::drivers::sixk
