// Kills rigd at random and chosen instants over virtual nights with faults, and judges every scan.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <unistd.h>

#include "core/base/command_line.h"
#include "core/base/random.h"
#include "tests/soak/night.h"

namespace {

namespace fs = std::filesystem;
using namespace rig;
using Steady = std::chrono::steady_clock;

struct Options {
  double minutes = 0;
  int kills = 300;
  std::uint64_t seed = 1;
  std::size_t poses = 40;
  std::string folder;
};

struct Total {
  int nights = 0, changed_nights = 0, kills = 0, deaths = 0, stops = 0, failed_attempts = 0;
  int suspensions = 0, restarts = 0, given_back = 0;
  int good_visits = 0, bad_visits = 0, unproven_visits = 0;
  std::int64_t poses = 0, done = 0, abandoned = 0;
  std::size_t frames_compared = 0;
  std::size_t problems = 0;
  std::map<std::string, int> reasons;
};

// The same frames as in the undisturbed night, no more and no fewer.
void compare(const soak::NightReport& calm, soak::NightReport& night, Total& total) {
  if (night.done != night.poses) {
    night.problems.push_back(fmt::format("{} of {} poses are done", night.done, night.poses));
  }
  for (const auto& [file, hash] : calm.frame_hashes) {
    const auto found = night.frame_hashes.find(file);
    if (found == night.frame_hashes.end()) {
      night.problems.push_back(file + " is missing");
    } else if (found->second != hash) {
      night.problems.push_back(file + " differs from the undisturbed night's");
    }
    ++total.frames_compared;
  }
  if (night.frame_hashes.size() != calm.frame_hashes.size())
    night.problems.push_back("there are more frames than in the undisturbed night");
}

base::Result<void> run(const Options& options, Total& total) {
  const auto begin = Steady::now();
  soak::NightOptions night;
  night.shipped = fs::path(RIG_SOURCE_DIR) / "share/virtual/rig.toml";
  night.rigd = fs::read_symlink("/proc/self/exe").parent_path() / "rigd";
  const auto enough = [&] {
    const double minutes = std::chrono::duration<double>(Steady::now() - begin).count() / 60;
    return total.kills + total.deaths >= options.kills && minutes >= options.minutes;
  };
  soak::NightReport calm;
  constexpr int kNightsPerJob = 4;
  for (int i = 0; !enough(); ++i) {
    night.seed = base::derive_key(options.seed, static_cast<std::uint64_t>(i)) >> 2;  // TOML has 63 bits
    if (i % kNightsPerJob == 0) {
      auto job = soak::random_job(night.shipped, options.poses, night.seed);
      if (!job) return base::pass(job);
      night.job_toml = *job;
      night.folder = fs::path(options.folder) / fmt::format("calm-{}", i);
      auto undisturbed = soak::undisturbed_night(night);
      if (!undisturbed) return base::pass(undisturbed);
      calm = std::move(*undisturbed);
      if (!calm.problems.empty() || calm.done != calm.poses)
        return base::fail(base::ErrorCode::damaged, "the undisturbed night is not right",
                          night.folder.string());
      fs::remove_all(night.folder);
    }
    night.folder = fs::path(options.folder) / fmt::format("night-{}", i);
    night.changes_pixels = i % kNightsPerJob == kNightsPerJob - 1;
    night.kills = static_cast<int>(options.poses) * 3 / 4;
    auto judged = soak::disturbed_night(night);
    if (!judged) return base::pass(judged);
    if (!night.changes_pixels) compare(calm, *judged, total);
    ++(night.changes_pixels ? total.changed_nights : total.nights);
    total.kills += judged->kills;
    total.deaths += judged->deaths;
    total.stops += judged->stops;
    total.suspensions += judged->suspensions;
    total.restarts += judged->restarts;
    total.given_back += judged->given_back;
    total.failed_attempts += judged->failed_attempts;
    total.good_visits += judged->good_visits;
    total.bad_visits += judged->bad_visits;
    total.unproven_visits += judged->unproven_visits;
    total.poses += judged->poses;
    total.done += judged->done;
    total.abandoned += judged->abandoned;
    total.problems += judged->problems.size();
    for (const auto& [reason, times] : judged->reasons) total.reasons[reason] += times;
    for (const std::string& problem : judged->problems)
      std::printf("PROBLEM in %s: %s\n", night.folder.c_str(), problem.c_str());
    if (judged->problems.empty()) fs::remove_all(night.folder);
    std::printf(
        "night %d: %d kills, %d deaths at chosen instants, %d stops, %d failed attempts, %lld of %lld "
        "poses done, %lld abandoned\n",
        i + 1, judged->kills, judged->deaths, judged->stops, judged->failed_attempts,
        static_cast<long long>(judged->done), static_cast<long long>(judged->poses),
        static_cast<long long>(judged->abandoned));
    std::fflush(stdout);
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.folder = (fs::temp_directory_path() / fmt::format("rigd-soak-{}", ::getpid())).string();
  CLI::App app{"kills rigd over virtual nights with faults, and judges every scan"};
  app.add_option("--minutes", options.minutes, "at least so long")->check(CLI::Range(0.0, 1e5));
  app.add_option("--kills", options.kills, "at least so many")->check(CLI::Range(1, 1000000));
  app.add_option("--poses", options.poses, "of each night")->check(CLI::Range(2, 10000));
  app.add_option("--seed", options.seed, "of everything random");
  app.add_option("--folder", options.folder, "for the nights; one that has a problem stays there");
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  std::printf("seed %llu, in %s\n", static_cast<unsigned long long>(options.seed), options.folder.c_str());
  const auto begin = Steady::now();
  Total total;
  const auto done = run(options, total);
  std::printf("\n%d nights compared frame by frame, %d judged by their accounts, %.1f minutes\n",
              total.nights, total.changed_nights,
              std::chrono::duration<double>(Steady::now() - begin).count() / 60);
  std::printf("rigd was killed %d times: %d at random, %d at chosen instants\n", total.kills + total.deaths,
              total.kills, total.deaths);
  std::printf("%lld poses: %lld done, %lld abandoned with a reason, %d failed attempts\n",
              static_cast<long long>(total.poses), static_cast<long long>(total.done),
              static_cast<long long>(total.abandoned), total.failed_attempts);
  std::printf("%d reference visits: %d good, %d bad, %d with nothing to compare with yet\n",
              total.good_visits + total.bad_visits + total.unproven_visits, total.good_visits,
              total.bad_visits, total.unproven_visits);
  std::printf("%d poses given back by bad visits; the reports tell of %d restarts\n", total.given_back,
              total.restarts);
  std::printf("%d stops latched and cleared, %d suspensions that ended by themselves:\n", total.stops,
              total.suspensions);
  for (const auto& [reason, times] : total.reasons) std::printf("  %5d  %s\n", times, reason.c_str());
  std::printf("%zu frames compared with the undisturbed night's, %zu problems\n", total.frames_compared,
              total.problems);
  if (!done) {
    std::printf("FAILED: %s\n", done.error().text().c_str());
    return 1;
  }
  constexpr int kNightsEnough = 10;
  if (total.changed_nights >= kNightsEnough && (total.bad_visits == 0 || total.given_back == 0)) {
    std::printf("FAILED: no excursion of the light was seen by a visit\n");
    return 1;
  }
  if (total.problems > 0) return 1;
  fs::remove_all(options.folder);
  return 0;
}
