// Fiducial tags in a grey image: found and read by libapriltag (Wang and Olson 2016), their corners refined
// by fitting the four edges to every pixel beside them.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "calibration/fiducials/grey_image.h"
#include "core/base/result.h"
#include "core/geometry/camera.h"
#include "core/geometry/vec.h"

namespace rig::calibration {

/// A tag in an image. Pixel (0, 0) is the centre of the first pixel (libapriltag has it at (0.5, 0.5)).
struct TagSighting {
  int id = 0;
  /// Corners of the black square in the order of the upright tag: lower left, lower right, upper right, upper
  /// left. Seen from the front of the carrier that is (-x,-y) (+x,-y) (+x,+y) (-x,+y) for a tag of turn 0.
  std::array<geometry::Vec2, 4> corners;
  /// Standard deviation of each corner's position, pixels, root mean square of both directions; from the
  /// residuals of the edge fits.
  std::array<double, 4> corner_sigma_px{};
  bool refined = false;        ///< false where an edge could not be fitted: the corners are libapriltag's
  int corrected_bits = 0;      ///< of the code
  double decision_margin = 0;  ///< contrast of the code's bits as libapriltag judges it
};

struct TagFinderOptions {
  int threads = 1;      ///< of libapriltag
  double decimate = 2;  ///< quads are sought in an image this much smaller; corners do not suffer from it
  /// Bit errors tolerated in a code, of the two that libapriltag can correct: with two, a cluttered
  /// photograph shows tags that are none.
  int corrected_bits = 1;
  bool refine = true;  ///< fit the edges
};

/// Standard deviation that an unrefined corner is given, pixels.
inline constexpr double kUnrefinedSigmaPx = 0.5;

/// One finder serves one thread at a time.
class TagFinder {
 public:
  /// Families with a black square border: tag36h11, tag25h9, tag16h5.
  [[nodiscard]] static base::Result<TagFinder> create(const std::string& family,
                                                      const TagFinderOptions& options = {});
  TagFinder(TagFinder&&) noexcept;
  TagFinder& operator=(TagFinder&&) noexcept;
  ~TagFinder();

  /// All tags, in the order of their ids; an id may be there twice. With `lens`, the bending of straight
  /// edges by its distortion is allowed for (its position is not taken out: corners are pixels of the image).
  [[nodiscard]] std::vector<TagSighting> find(const GreyImage& image,
                                              const geometry::CameraIntrinsics* lens = nullptr);

 private:
  struct State;
  explicit TagFinder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::calibration
