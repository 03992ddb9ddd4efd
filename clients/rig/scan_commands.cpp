#include "clients/rig/scan_commands.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>
#include <utility>

#include "core/base/interrupt.h"
#include "core/base/progress.h"
#include "core/scan/push.h"
#include "core/scan/recover.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

constexpr std::chrono::milliseconds kLookAgain{2000};
constexpr std::chrono::milliseconds kInterruptSeen{100};

// A progress bar that is there as long as there is something to do.
class Bar {
 public:
  Bar(std::string stage, std::string unit) : stage_(std::move(stage)), unit_(std::move(unit)) {}
  void done_one(std::size_t left) {
    if (!progress_) progress_ = std::make_unique<base::Progress>(stage_, left + 1, unit_);
    progress_->add();
    if (left == 0) progress_.reset();
  }

 private:
  std::string stage_, unit_;
  std::unique_ptr<base::Progress> progress_;
};

}  // namespace

Result<void> scan_recover(const std::string& scan, bool even_if_whole) {
  Bar bar("recover", "rows");
  scan::RecoverOptions options;
  options.even_if_whole = even_if_whole;
  options.on_row = [&bar](std::size_t left) { bar.done_one(left); };
  const auto report = scan::recover_journal(scan, options);
  if (!report) return pass(report);
  std::size_t done = 0;
  std::size_t abandoned = 0;
  for (const scan::RecoveredRow& row : report->rows) {
    const auto number = static_cast<long long>(row.row);
    switch (row.state) {
      case scan::RowState::done:
        ++done;
        std::printf("row %lld: recovered, %d frames, %s\n", number, row.frames,
                    row.proven ? "with the hashes of the old journal" : "hashed anew");
        break;
      case scan::RowState::abandoned:
        ++abandoned;
        std::printf("row %lld: abandoned, as before: %s\n", number, row.reason.c_str());
        break;
      case scan::RowState::pending:
        std::printf("row %lld: pending: %s\n", number, row.reason.c_str());
        break;
    }
  }
  for (const scan::RecoveredVisit& visit : report->visits) {
    const auto number = static_cast<long long>(visit.number);
    if (!visit.reason.empty()) {
      std::printf("reference visit %lld: not kept: %s\n", number, visit.reason.c_str());
    } else {
      std::printf("reference visit %lld: recovered, %d frames%s\n", number, visit.frames,
                  visit.judged ? "" : "; its verdict was lost, so it counts for nothing");
    }
  }
  if (!report->kept.empty()) std::printf("the old journal is kept: %s\n", report->kept.filename().c_str());
  std::printf("%zu of %zu poses recovered, %zu abandoned, %zu pending%s\n", done, report->rows.size(),
              abandoned, report->rows.size() - done - abandoned,
              done + abandoned == report->rows.size()
                  ? ""
                  : "; rigd takes these when the job goes on, and removes what lies in their folders");
  return {};
}

Result<void> scan_push(const std::string& scan, const std::string& to, bool follow) {
  Bar bar("push", "frames");
  const auto on_frame = [&bar](std::size_t left) { bar.done_one(left); };
  std::int64_t told = -1;
  const auto wait = [&told](const scan::PushReport& report) {
    if (report.progress.done != std::exchange(told, report.progress.done)) {
      std::fprintf(stderr, "push: %lld of %lld poses; waiting for the next\n",
                   static_cast<long long>(report.progress.done),
                   static_cast<long long>(report.progress.total));
    }
    const auto until = std::chrono::steady_clock::now() + kLookAgain;
    while (std::chrono::steady_clock::now() < until && !base::interrupted())
      std::this_thread::sleep_for(kInterruptSeen);
    return !base::interrupted();
  };
  const auto report =
      follow ? scan::follow_scan(scan, to, on_frame, wait) : scan::push_scan(scan, to, on_frame);
  if (!report) return pass(report);
  for (const std::string& problem : report->problems) std::printf("problem: %s\n", problem.c_str());
  std::printf("%lld of %lld poses are there; %zu frames copied and verified (%.1f MB), %zu were there: %s\n",
              static_cast<long long>(report->progress.done), static_cast<long long>(report->progress.total),
              report->frames_copied, static_cast<double>(report->bytes_copied) * 1e-6, report->frames_there,
              report->complete() ? "complete" : "not complete");
  if (base::interrupted()) return base::interrupted_error("push again to go on");
  if (report->problems.empty()) return {};
  return fail(ErrorCode::damaged, "frames of the scan are damaged", scan, "see the problems above");
}

}  // namespace rig::client
