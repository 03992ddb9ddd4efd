// A virtual rig in a folder, a rigd that is killed on it, and what became of its scan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::soak {

/// What a night is made of. Everything random comes from the seed.
struct NightOptions {
  std::filesystem::path folder;   ///< of this night alone; made here
  std::filesystem::path shipped;  ///< share/virtual/rig.toml
  std::filesystem::path rigd;     ///< the program
  std::string job_toml;
  std::uint64_t seed = 0;
  int kills = 0;                ///< before the scan may end undisturbed
  bool changes_pixels = false;  ///< also faults that must change the frames
};

struct NightReport {
  int kills = 0;                        ///< by a signal at a moment of the wall or of an event
  int deaths = 0;                       ///< at a chosen instant around a write, flush, rename or commit
  int stops = 0;                        ///< latched by a fault, and cleared
  int suspensions = 0;                  ///< by a fault, which ended by themselves
  int restarts = 0;                     ///< of rigd, that the morning report tells of
  int given_back = 0;                   ///< poses that a bad visit made pending again, as far as was heard
  int failed_attempts = 0;              ///< of poses, in the journal
  int good_visits = 0, bad_visits = 0;  ///< to the reference patches
  int unproven_visits = 0;              ///< the first ones, with nothing to compare with
  std::int64_t poses = 0, done = 0, abandoned = 0;
  std::map<std::string, int> reasons;               ///< of stops and suspensions, without their figures
  std::map<std::string, std::string> frame_hashes;  ///< by file
  std::vector<std::string> problems;                ///< empty: all is well
};

/// Runs the job to its end on a rig without faults (`kills` and the fault fields are ignored).
[[nodiscard]] base::Result<NightReport> undisturbed_night(const NightOptions& options);

/// Runs the job to its end with faults and kills. Whatever contradicts a promise is among the problems; an
/// Error is what keeps the night from being judged at all.
[[nodiscard]] base::Result<NightReport> disturbed_night(const NightOptions& options);

/// A job of so many poses and three exposures that the shipped rig can do, chosen by the seed.
[[nodiscard]] base::Result<std::string> random_job(const std::filesystem::path& shipped, std::size_t poses,
                                                   std::uint64_t seed,
                                                   const std::vector<double>& exposures_s = {0.06, 0.0075,
                                                                                             0.001});

}  // namespace rig::soak
