// A driver module through its door, as rigd opens it.
#pragma once

#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/clock.h"
#include "core/base/config.h"
#include "drivers/host/module_loader.h"
#include "tests/core/temporary_folder.h"

namespace rig::test {

class LoadedModule {
 public:
  /// "ptu_axis": built beside this program. What is wrong with it is thrown.
  explicit LoadedModule(const std::string& name) {
    const auto loaded = drivers::load_module(name, {RIG_BINARY_DIR "/lib"});
    if (!loaded) throw std::runtime_error(loaded.error().text());
    entry_ = *loaded;
    EXPECT_EQ(entry_->name, name);
  }

  /// What it finds wrong with this text as its settings; empty: nothing.
  [[nodiscard]] std::string faults_of(const std::string& settings) const {
    const auto table = parsed(settings);
    entry_->check(table);
    const auto noted = table.noted();
    return noted ? "" : noted.error().text();
  }

  /// Its devices, whose clock and folder live as long as this.
  [[nodiscard]] base::Result<std::vector<drivers::Device>> open(const std::string& settings) const {
    const auto table = parsed(settings);
    return entry_->open({"module", table, folder_.path(), *clock_, [](base::LogLevel, std::string_view) {}});
  }

 private:
  static base::ConfigTable parsed(const std::string& settings) {
    auto table = base::ConfigTable::parse(settings, "rig.toml");
    if (!table) throw std::runtime_error(table.error().text());
    return *table;
  }

  const TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  const drivers::ModuleEntry* entry_ = nullptr;
};

/// Of a module for axes at a serial line: settings that are wrong in port, baud and its axis are told by
/// their keys, and an absent line is lost. `axis` is the whole table of a good one.
inline void expect_serial_axis_module(const std::string& name, const std::string& axis) {
  const LoadedModule module(name);
  const std::string header = axis.substr(0, axis.find('\n') + 1);
  const std::string faults = module.faults_of("port = 3\nbaud = 1\n" + header);
  for (const char* key : {"port", "baud", "max_velocity_deg_s"})
    EXPECT_NE(faults.find(key), std::string::npos) << key << " in: " << faults;
  const TemporaryFolder folder;
  const auto devices = module.open("port = \"" + (folder / "nowhere").string() + "\"\n" + axis);
  ASSERT_FALSE(devices.has_value());
  EXPECT_EQ(devices.error().code, base::ErrorCode::lost);
  EXPECT_NE(devices.error().text().find("plugged in"), std::string::npos) << devices.error().text();
}

}  // namespace rig::test
