// A frame of 24 MiB, from "complete" to "a client on the same machine has mapped it and read its first and
// its last sample", as rigd hands it over; beside a plain copy and beside INDI, in turn.
#include <cstdio>
#include <optional>
#include <unistd.h>

#include "bench/frames/ways.h"
#include "core/base/command_line.h"

namespace {

namespace fs = std::filesystem;
using namespace rig;
using bench::Latencies;

constexpr double kMost_us = 1000;
constexpr double kLeastTimesFaster = 200;  // than INDI
constexpr int kOursPerRound = 10;          // the others take long
constexpr int kRigdFramesPerRound = 3;     // rigd stores them

void print(const char* name, const Latencies& latencies) {
  std::printf("%-40s p50 %9.0f us   p99 %9.0f us   of %zu\n", name, latencies.quantile_us(0.5),
              latencies.quantile_us(0.99), latencies.count());
}

// rigd at work, alone: it would take from the others' turns.
base::Result<bool> run_rigd(const fs::path& folder, int frames) {
  auto way = bench::RigdWay::open(folder, frames);
  if (!way) return base::pass(way);
  Latencies latencies;
  for (int i = 0; i < frames; ++i) {
    const auto took = way->pass();
    if (!took) return base::pass(took);
    latencies.add(*took);
  }
  print("from rigd while it takes and stores", latencies);
  const double typical_us = latencies.quantile_us(0.5);
  const bool fine = typical_us <= kMost_us;
  std::printf("from rigd, p50 over %.0f us: %.2f (at most 1)%s\n", kMost_us, typical_us / kMost_us,
              fine ? "" : "  TOO MUCH");
  return fine;
}

base::Result<bool> run_ways(const fs::path& folder, int rounds) {
  auto ours = bench::DescriptorWay::open(folder);
  if (!ours) return base::pass(ours);
  std::optional<bench::IndiWay> indi;
  if (auto way = bench::IndiWay::open(folder / "indi"); way) {
    indi.emplace(std::move(*way));
  } else {
    std::printf("INDI: skipped, %s\n", way.error().text().c_str());
  }
  Latencies descriptor;
  Latencies copied;
  Latencies theirs;
  std::uint16_t value = 0;
  for (int round = 0; round < rounds; ++round) {
    for (int i = 0; i < kOursPerRound; ++i) {
      auto took = ours->pass(++value);
      if (!took) return base::pass(took);
      descriptor.add(*took);
    }
    auto took = bench::copy_through_stream(value);
    if (!took) return base::pass(took);
    copied.add(*took);
    if (!indi) continue;
    took = indi->pass();
    if (!took) return base::pass(took);
    theirs.add(*took);
  }
  print("descriptor handed over", descriptor);
  print("copied through a Unix stream", copied);
  const double ours_us = descriptor.quantile_us(0.5);
  const double worst_us = descriptor.quantile_us(0.99);
  std::printf("copied over handed over: %.0f\n", copied.quantile_us(0.5) / ours_us);
  bool fine = worst_us <= kMost_us;
  std::printf("handed over, p99 over %.0f us: %.2f (at most 1)%s\n", kMost_us, worst_us / kMost_us,
              fine ? "" : "  TOO MUCH");
  if (indi) {
    const double times = theirs.quantile_us(0.5) / ours_us;
    print("INDI's base64 over TCP", theirs);
    std::printf("INDI over handed over: %.0f (at least %.0f)%s\n", times, kLeastTimesFaster,
                times >= kLeastTimesFaster ? "" : "  TOO LITTLE");
    fine &= times >= kLeastTimesFaster;
  }
  return fine;
}

base::Result<bool> run(const fs::path& folder, int rounds) {
  const auto ways = run_ways(folder, rounds);
  if (!ways) return base::pass(ways);
  const auto rigd = run_rigd(folder / "rigd", rounds * kRigdFramesPerRound);
  if (!rigd) return base::pass(rigd);
  return *ways && *rigd;
}

}  // namespace

int main(int argc, char** argv) {
  int rounds = 30;
  CLI::App app{"a frame of 24 MiB on its way to a client on the same machine"};
  app.add_option("--rounds", rounds, "of each way")->check(CLI::Range(1, 1000));
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  const fs::path folder = fs::current_path() / fmt::format("bench-frames-{}", ::getpid());
  fs::create_directories(folder);
  const auto fine = run(folder, rounds);
  std::error_code left_behind;
  fs::remove_all(folder, left_behind);
  if (!fine) {
    std::fprintf(stderr, "bench_frames: %s\n", fine.error().text().c_str());
    return 1;
  }
  return *fine ? 0 : 1;
}
