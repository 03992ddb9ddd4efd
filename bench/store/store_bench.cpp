// Committing a pose (three frames encoded, hashed, flushed, renamed, journalled) beside the least that could
// keep them: the same bytes written, hashed and flushed, and the folder renamed and flushed. On the disk of
// the current folder.
#include <benchmark/benchmark.h>
#include <chrono>
#include <filesystem>
#include <unistd.h>

#include "core/base/files.h"
#include "core/base/hash.h"
#include "core/scan/scan_directory.h"

namespace {

using namespace rig;
namespace fs = std::filesystem;
using Steady = std::chrono::steady_clock;

constexpr int kWidth = 1600;
constexpr int kHeight = 1200;
constexpr int kFrames = 3;

struct Folder {
  fs::path path = fs::current_path() / ("bench-store-" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code left_behind;
    fs::remove_all(path, left_behind);
  }
};

base::Result<void> commit_pose(const fs::path& scan, scan::Journal& journal, std::int64_t row,
                               const std::vector<std::uint16_t>& pixels) {
  scan::PoseRecord record;
  record.row = row;
  for (int i = 0; i < kFrames; ++i) {
    scan::FrameFacts facts;
    facts.row = row;
    facts.index = i;
    facts.exposure_s = 0.01;
    facts.bayer = "RGGB";
    facts.bits = 12;
    auto hash = scan::store_frame(scan, facts, kWidth, kHeight, pixels.data());
    if (!hash) return base::pass(hash);
    scan::FrameRecord frame;
    frame.index = i;
    frame.exposure_s = 0.01;
    frame.file = "frames/" + scan::frames_folder(scan, row).filename().string() + "/" + scan::frame_name(i);
    frame.sha256 = *hash;
    record.frames.push_back(frame);
  }
  if (auto ok = scan::publish_bracket(scan, row); !ok) return ok;
  return journal.commit_pose(record, {});
}

base::Result<void> bare(const fs::path& folder, std::int64_t row, const std::vector<std::uint16_t>& pixels) {
  const fs::path part = folder / ("bare-" + std::to_string(row) + ".part");
  fs::create_directories(part);
  for (int i = 0; i < kFrames; ++i) {
    const auto bytes = std::as_bytes(std::span(pixels));
    benchmark::DoNotOptimize(base::sha256_hex(bytes));
    if (auto ok = base::write_and_flush(part / std::to_string(i), bytes); !ok) return ok;
  }
  if (auto ok = base::flush_folder(part); !ok) return ok;
  return base::rename_durably(part, folder / ("bare-" + std::to_string(row)));
}

void commit_pose(benchmark::State& state) {
  const Folder folder;
  const fs::path scan = folder.path / "scan";
  fs::create_directories(scan / "frames");
  auto journal = scan::Journal::create(scan::journal_path(scan), std::vector<machine::JointAngles>(100000));
  if (!journal) return state.SkipWithError(journal.error().text().c_str());
  std::vector<std::uint16_t> pixels(std::size_t{kWidth} * kHeight);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<std::uint16_t>((i * 2654435761U) >> 20);
  double ours_s = 0;
  double bare_s = 0;
  std::int64_t row = 0;
  for ([[maybe_unused]] auto _ : state) {
    const auto begin = Steady::now();
    if (auto ok = commit_pose(scan, *journal, row, pixels); !ok)
      return state.SkipWithError(ok.error().text().c_str());
    const auto middle = Steady::now();
    if (auto ok = bare(folder.path, row, pixels); !ok) return state.SkipWithError(ok.error().text().c_str());
    const auto end = Steady::now();
    const double ours = std::chrono::duration<double>(middle - begin).count();
    state.SetIterationTime(ours);
    ours_s += ours;
    bare_s += std::chrono::duration<double>(end - middle).count();
    ++row;
  }
  state.counters["ours_over_bare_time"] = ours_s / bare_s;
}
BENCHMARK(commit_pose)->UseManualTime()->Unit(benchmark::kMillisecond)->Iterations(60);

}  // namespace
