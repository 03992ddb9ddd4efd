// Brings an opened camera into the state that the settings ask for.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/aravis_camera/glib.h"
#include "drivers/aravis_camera/settings.h"

namespace rig::drivers::aravis {

/// What the camera turned out to be, once it is configured.
struct Configured {
  CameraCapabilities capabilities;
  int offset_x = 0, offset_y = 0;
  std::size_t payload_bytes = 0;      ///< of a frame on the wire
  double min_gain = 0, max_gain = 0;  ///< of its gain feature
  bool has_gain = false;
  bool whole_gains = false;      ///< the gain feature takes whole numbers only
  bool runs_free = false;        ///< it cannot be triggered: Aravis' own, inside this process
  bool tells_readiness = false;  ///< AcquisitionStatus says when it waits for a trigger
  bool can_abort = false;        ///< AcquisitionAbort ends an exposure; a stop lets it end
  bool has_chunks = false;       ///< exposure and time come with each frame
  std::string temperature;       ///< the feature; empty: it has none
};

/// Everything but what changes from exposure to exposure. It does not take frames afterwards. Errors: device
/// (a feature is missing, or refuses the value), lost.
[[nodiscard]] base::Result<Configured> configure(ArvCamera* camera, const Settings& settings);

}  // namespace rig::drivers::aravis
