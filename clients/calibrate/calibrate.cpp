#include "clients/calibrate/calibrate.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "calibration/registration_file.h"
#include "calibration/scan_registration.h"
#include "core/base/hash.h"
#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/base/units.h"
#include "core/scan/scan_directory.h"

namespace rig::calibrate {

namespace {

using calibration::PoseRegistration;
using calibration::TagFinder;

// Finders are dear to make and serve one thread at a time.
class FinderPool {
 public:
  explicit FinderPool(std::string family) : family_(std::move(family)) {}

  base::Result<TagFinder> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        TagFinder finder = std::move(idle_.back());
        idle_.pop_back();
        return finder;
      }
    }
    return TagFinder::create(family_);
  }
  void give_back(TagFinder finder) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(finder));
  }

 private:
  std::string family_;
  std::mutex mutex_;
  std::vector<TagFinder> idle_;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::size_t CalibrateSummary::registered() const {
  return static_cast<std::size_t>(std::count_if(
      poses.begin(), poses.end(), [](const PoseRegistration& pose) { return pose.registered; }));
}

std::string CalibrateSummary::text() const {
  std::string out = fmt::format("{} of {} poses registered", registered(), taken);
  if (taken < planned) out += fmt::format(" ({} of the plan's {} are not taken)", planned - taken, planned);
  out += '\n';
  std::vector<double> rms, error;
  for (const PoseRegistration& pose : poses) {
    if (!pose.registered) continue;
    rms.push_back(pose.rms_px);
    error.push_back(base::mm_from_metres(pose.expected_error_m));
  }
  if (!rms.empty()) {
    out += fmt::format("residual of the tags: median {:.3f} px, largest {:.3f} px\n", median(rms),
                       *std::max_element(rms.begin(), rms.end()));
    out += fmt::format("expected error in the sample plane: median {:.4f} mm, largest {:.4f} mm\n",
                       median(error), *std::max_element(error.begin(), error.end()));
  }
  for (const PoseRegistration& pose : poses) {
    if (!pose.registered) out += fmt::format("row {} left out: {}\n", pose.row, pose.reason);
  }
  return out;
}

base::Result<CalibrateSummary> calibrate_scan(const std::filesystem::path& scan,
                                              const calibration::RegistrationLimits& limits) {
  auto view = scan::open_scan(scan);
  if (!view) return base::pass(view);
  auto rig_sha256 = base::sha256_of_file(scan / "rig.toml");
  if (!rig_sha256) return base::pass(rig_sha256);
  if (view->poses.empty()) {
    return base::fail(base::ErrorCode::bad_input, "no pose of the scan is taken yet", scan.string());
  }

  FinderPool finders(view->rig.carrier.tag_family);
  CalibrateSummary summary;
  summary.planned = view->plan.size();
  summary.taken = view->poses.size();
  summary.poses.resize(view->poses.size());
  base::Progress progress("registration", view->poses.size(), "poses");
  std::mutex failure_mutex;
  std::optional<base::Error> failure;
  base::parallel_for(view->poses.size(), 1, [&](std::size_t begin, std::size_t end) {
    auto finder = finders.take();
    if (!finder) {
      const std::lock_guard lock(failure_mutex);
      failure = finder.error();
      return;
    }
    for (std::size_t i = begin; i < end && !base::interrupted(); ++i) {
      summary.poses[i] = calibration::register_pose(scan, view->rig, view->poses[i], *finder, limits);
      progress.add();
    }
    finders.give_back(std::move(*finder));
  });
  if (failure) return tl::unexpected(*failure);
  if (base::interrupted()) {
    return base::interrupted_error("registration.toml is as it was; run the command again to register");
  }
  const calibration::RegistrationFile file{*rig_sha256, summary.poses};
  if (auto written = calibration::write_registration(scan, file); !written) return base::pass(written);
  return summary;
}

}  // namespace rig::calibrate
