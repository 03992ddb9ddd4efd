// The numbers of a report.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "appearance/lafortune.h"
#include "clients/report/picture.h"
#include "core/base/result.h"
#include "core/maps/observation_map.h"
#include "core/maps/parameter_map.h"

namespace rig::report {

/// The model of one texel of a parameter map.
[[nodiscard]] appearance::Lafortune model_at(const maps::ParameterMap& map, std::size_t texel);

/// A map's rendering of one view against its photograph, rendering minus photograph, over the texels whose
/// value is right (good or dark): luminance of f cos(theta_i).
struct ViewError {
  double mean = 0, deviation = 0, mean_absolute = 0;
  std::size_t texels = 0;
};

struct View {
  int pose = 0;
  double incident_deg = 0, exitant_deg = 0;  ///< at the sample's centre
  Picture photograph;
  std::vector<Picture> renderings;  ///< one a map
  std::vector<ViewError> errors;    ///< over the whole sample, one a map
  std::vector<double> rough_error;  ///< mean absolute, regions of alpha >= 0.08; empty without regions
};
/// `maps` and `regions` are of the observation map's size.
[[nodiscard]] base::Result<View> make_view(const maps::ObservationReader& observation, int pose,
                                           const std::vector<maps::ParameterMap>& maps,
                                           const maps::ParameterMap* regions);

/// What the truth of a virtual rig says about the calibration and the map. A figure that nothing entered is
/// NaN.
struct TruthFigures {
  double registration_rms_mm = 0;  ///< over a 9 x 9 grid, poses up to 60 degrees
  std::size_t registered_poses = 0;
  double reflectance_error = 0;  ///< median relative error, both polar angles up to 60 degrees
  std::size_t values = 0;
};
[[nodiscard]] base::Result<TruthFigures> compare_with_truth(const maps::ObservationReader& observation,
                                                            const std::filesystem::path& truth);

/// Poses a map was not fitted to, from its attributes, each once. Words that are no pose numbers are passed
/// over.
[[nodiscard]] std::vector<int> held_out_poses(const maps::ParameterMap& map);

}  // namespace rig::report
