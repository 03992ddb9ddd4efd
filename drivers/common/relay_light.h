// A light that is switched by a relay and, where there is one, opened by a shutter: two output lines of any
// module that has lines.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/clock.h"
#include "core/base/config.h"
#include "core/base/result.h"
#include "drivers/api/device.h"
#include "drivers/common/lamp_record.h"

namespace rig::drivers {

struct RelayLightSettings {
  std::string relay;    ///< name of the output that switches the lamp on
  std::string shutter;  ///< name of the output that opens the shutter; empty: there is none
  double warm_up_s = 0;
};

/// The keys `relay`, `shutter` and `warm_up_s`. Mistakes are noted in the table, a name that is no output of
/// `lines` among them.
[[nodiscard]] RelayLightSettings read_relay_light_settings(const base::ConfigTable& table,
                                                           const std::vector<Line>& lines);

/// `lines` must belong to the light alone: a reading takes from it what its inputs have seen. Levels are read
/// from the lines at every look, never remembered. The lamp's hours are kept in `hours_file`.
[[nodiscard]] base::Result<std::unique_ptr<Light>> make_relay_light(const RelayLightSettings& settings,
                                                                    std::unique_ptr<DigitalIo> lines,
                                                                    const std::filesystem::path& hours_file,
                                                                    base::Clock& clock, LampRecord::Log log);

}  // namespace rig::drivers
