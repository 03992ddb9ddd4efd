// The settings of a module for devices at a serial line as a text, and the module opened with them.
#pragma once

#include <filesystem>
#include <fmt/format.h>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/api/module.h"
#include "tests/core/temporary_folder.h"

namespace rig::test {

class SettingsAtPort {
 public:
  using Open = base::Result<std::vector<drivers::Device>> (*)(const drivers::OpenContext&);

  /// `text` without its port.
  SettingsAtPort(Open opened_by, const std::string& text, const std::filesystem::path& port,
                 const TemporaryFolder& folder)
      : open_(opened_by),
        table_(parse(fmt::format("port = \"{}\"\n{}", port.string(), text))),
        folder_(folder.path()) {}

  [[nodiscard]] base::Result<std::vector<drivers::Device>> open(base::Clock& clock) const {
    return open_({"module", table_, folder_, clock, [](base::LogLevel, std::string_view) {}});
  }

 private:
  static base::ConfigTable parse(const std::string& text) {
    auto table = base::ConfigTable::parse(text, "rig.toml");
    if (!table) throw std::runtime_error(table.error().text());
    return *table;
  }

  const Open open_;
  const base::ConfigTable table_;
  const std::filesystem::path folder_;
};

}  // namespace rig::test
