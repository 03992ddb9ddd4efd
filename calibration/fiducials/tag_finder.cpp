#include "calibration/fiducials/tag_finder.h"

#include <algorithm>
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <cmath>

#include "calibration/fiducials/tag_edges.h"

namespace rig::calibration {

namespace {

struct FamilyKind {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr std::array<FamilyKind, 3> kFamilies{{
    {"tag36h11", &tag36h11_create, &tag36h11_destroy},
    {"tag25h9", &tag25h9_create, &tag25h9_destroy},
    {"tag16h5", &tag16h5_create, &tag16h5_destroy},
}};

// Eight bits with equal steps of the square root: photon noise becomes even, and a dim tag beside a highlight
// keeps its contrast. Only the search sees it, not the edge fit.
std::vector<std::uint8_t> eight_bits(const GreyImage& image) {
  constexpr double kWhiteShare = 0.999;
  std::vector<float> sorted(image.pixels);
  const auto white =
      sorted.begin() + static_cast<std::ptrdiff_t>(kWhiteShare * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), white, sorted.end());
  const float scale = 1.0F / std::max(*white, 1.0F);
  std::vector<std::uint8_t> out(image.pixels.size());
  std::transform(image.pixels.begin(), image.pixels.end(), out.begin(), [scale](float v) {
    return static_cast<std::uint8_t>(255.0F * std::sqrt(std::clamp(v * scale, 0.0F, 1.0F)));
  });
  return out;
}

}  // namespace

struct TagFinder::State {
  TagFinderOptions options;
  const FamilyKind* kind;
  apriltag_family_t* family;
  apriltag_detector_t* detector;

  State(const TagFinderOptions& wanted, const FamilyKind& family_kind)
      : options(wanted),
        kind(&family_kind),
        family(family_kind.create()),
        detector(apriltag_detector_create()) {
    apriltag_detector_add_family_bits(detector, family, options.corrected_bits);
    detector->nthreads = options.threads;
    detector->quad_decimate = static_cast<float>(options.decimate);
    detector->refine_edges = true;
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    apriltag_detector_destroy(detector);
    kind->destroy(family);
  }
};

TagFinder::TagFinder(std::unique_ptr<State> state) : state_(std::move(state)) {}
TagFinder::TagFinder(TagFinder&&) noexcept = default;
TagFinder& TagFinder::operator=(TagFinder&&) noexcept = default;
TagFinder::~TagFinder() = default;

base::Result<TagFinder> TagFinder::create(const std::string& family, const TagFinderOptions& options) {
  const auto kind = std::find_if(kFamilies.begin(), kFamilies.end(),
                                 [&](const FamilyKind& known) { return known.name == family; });
  if (kind == kFamilies.end()) {
    return base::fail(base::ErrorCode::bad_input, fmt::format("unknown tag family '{}'", family), {},
                      "tag36h11, tag25h9 or tag16h5");
  }
  return TagFinder(std::make_unique<State>(options, *kind));
}

std::vector<TagSighting> TagFinder::find(const GreyImage& image, const geometry::CameraIntrinsics* lens) {
  std::vector<std::uint8_t> bytes = eight_bits(image);
  image_u8_t view{image.width, image.height, image.width, bytes.data()};
  zarray_t* found = apriltag_detector_detect(state_->detector, &view);

  std::vector<TagSighting> sightings;
  for (int i = 0; i < zarray_size(found); ++i) {
    const apriltag_detection_t* detection = nullptr;
    zarray_get(found, i, static_cast<void*>(&detection));
    TagSighting sighting;
    sighting.id = detection->id;
    sighting.corrected_bits = detection->hamming;
    sighting.decision_margin = static_cast<double>(detection->decision_margin);
    for (std::size_t c = 0; c < 4; ++c) {
      sighting.corners[c] = {detection->p[c][0] - 0.5, detection->p[c][1] - 0.5};
      sighting.corner_sigma_px[c] = kUnrefinedSigmaPx;
    }
    if (state_->options.refine) {
      const auto refined = refine_corners(image, sighting.corners, detection->family->width_at_border, lens);
      if (refined) {
        sighting.corners = refined->corners;
        sighting.corner_sigma_px = refined->sigma_px;
        sighting.refined = true;
      }
    }
    sightings.push_back(sighting);
  }
  apriltag_detections_destroy(found);
  std::stable_sort(sightings.begin(), sightings.end(),
                   [](const TagSighting& a, const TagSighting& b) { return a.id < b.id; });
  return sightings;
}

}  // namespace rig::calibration
