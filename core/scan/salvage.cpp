#include "core/scan/salvage.h"

#include <cstdlib>

#include "core/base/files.h"

namespace rig::scan {

namespace fs = std::filesystem;
using base::pass;
using base::Result;

namespace {

// A folder for the copy, gone after it.
class Workplace {
 public:
  Workplace() {
    std::string pattern = (fs::temp_directory_path() / "rig-salvage-XXXXXX").string();
    if (::mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ~Workplace() {
    // What the system's folder for such things keeps too long is nobody's loss.
    if (!path_.empty()) (void)base::remove_tree(path_);
  }
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

Result<void> copy_if_there(const fs::path& from, const fs::path& to) {
  std::error_code error;
  if (!fs::exists(from, error)) return {};
  const auto bytes = base::read_file(from);
  if (!bytes) return pass(bytes);
  return base::write_file_durably(to, *bytes);
}

}  // namespace

Result<Salvage> salvage_journal(const fs::path& journal, std::int64_t rows) {
  const Workplace workplace;
  const fs::path copy = workplace.path() / "journal.sqlite";
  if (auto ok = copy_if_there(journal, copy); !ok) return pass(ok);
  if (auto ok = copy_if_there(journal.string() + "-wal", copy.string() + "-wal"); !ok) return pass(ok);
  Salvage salvage;
  const auto damaged = Journal::open_damaged(copy);
  if (!damaged) {
    if (damaged.error().code == base::ErrorCode::newer) return pass(damaged);
    return salvage;
  }
  for (std::int64_t row = 0; row < rows; ++row) {
    const auto line = damaged->plan_row(row);
    if (line && *line) salvage.rows[row] = **line;
    auto pose = damaged->pose(row);
    if (pose && *pose) salvage.poses[row] = std::move(**pose);
  }
  if (auto visits = damaged->visits()) salvage.visits = std::move(*visits);
  constexpr std::size_t kAtOnce = 64;
  EventRecord last;
  while (true) {
    auto events = damaged->events_after(last.epoch, last.number, kAtOnce);
    if (!events || events->empty()) return salvage;
    last = events->back();
    for (EventRecord& event : *events) salvage.events.push_back(std::move(event));
  }
}

}  // namespace rig::scan
