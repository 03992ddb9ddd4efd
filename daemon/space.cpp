#include "daemon/space.h"

namespace rig::daemon {

namespace {

constexpr double kBytesPerSample = 2;
constexpr double kHeader_bytes = 4096;   // of a frame's file, and what is left of its last block
constexpr double kJournal_bytes = 8192;  // of a pose, with its events
constexpr double kJournalFrame_bytes = 512;

}  // namespace

int most_frames(const machine::ExposureConfig& exposure) {
  return exposure.strategy == machine::ExposureStrategy::fixed ? static_cast<int>(exposure.exposures_s.size())
                                                               : exposure.most_frames;
}

double bracket_s(const Setup& setup, const machine::ExposureConfig& exposure) {
  double sum = 0;
  for (const double s : exposure.exposures_s) sum += s;
  if (exposure.strategy == machine::ExposureStrategy::halve) {
    for (int i = 0; i < exposure.most_frames; ++i) sum += exposure.longest_s / static_cast<double>(1ULL << i);
  }
  return sum + (most_frames(exposure) - 1) * setup.camera.readout_s;
}

double bytes_of_pose(const Setup& setup, const machine::JobConfig& job) {
  const auto& size = setup.rig.camera.intrinsics;
  const double frame = kBytesPerSample * static_cast<double>(size.width) * static_cast<double>(size.height) +
                       kHeader_bytes + kJournalFrame_bytes;
  return most_frames(job.exposure) * frame + kJournal_bytes;
}

}  // namespace rig::daemon
