// The module's settings as a text, and the module opened with them.
#pragma once

#include <filesystem>
#include <fmt/format.h>
#include <stdexcept>
#include <string>

#include "drivers/sixk_axis/devices.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::sixk::testing {

inline void no_log(base::LogLevel, std::string_view) {}

class ControllerSettings {
 public:
  /// `text` without its port.
  ControllerSettings(const std::string& text, const std::filesystem::path& port,
                     const test::TemporaryFolder& folder)
      : table_(parse(fmt::format("port = \"{}\"\n{}", port.string(), text))), folder_(folder.path()) {}

  [[nodiscard]] base::Result<std::vector<Device>> open(base::Clock& clock) const {
    return open_devices({"box", table_, folder_, clock, &no_log});
  }

 private:
  static base::ConfigTable parse(const std::string& text) {
    auto table = base::ConfigTable::parse(text, "rig.toml");
    if (!table) throw std::runtime_error(table.error().text());
    return *table;
  }

  const base::ConfigTable table_;
  const std::filesystem::path folder_;
};

}  // namespace rig::drivers::sixk::testing
