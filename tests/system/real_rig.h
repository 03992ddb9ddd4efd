// The virtual rig's rig.toml with real drivers in the place of its devices, which wire-level devices answer:
// by the wall's time, with small frames, and nothing to wait for that is not a device.
#pragma once

#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <regex>
#include <string>

#include "core/scan/frame_file.h"
#include "core/scan/verify.h"
#include "tests/system/running_rig.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {

/// rig.toml, part by part.
class RealRigToml {
 public:
  RealRigToml() : text_(tiny_rig_toml()) {
    set("clock = \"discrete-event\"\n", "");
    set("warm_up_s = 900\n", "warm_up_s = 0\n");
    for (auto at = text_.find("settle_ms = 300"); at != std::string::npos;
         at = text_.find("settle_ms = 300", at)) {
      text_.replace(at, std::string("settle_ms = 300").size(), "settle_ms = 20");
    }
    // Nothing of the simulated world is left.
    const auto module = text_.find("[[module]]");
    const auto end = text_.find("[axis.roll]");
    text_.erase(module, end - module);
    const auto stop = text_.find("[lines.emergency_stop]");
    text_.erase(stop, text_.find("\n\n", stop) - stop);
  }

  /// A module with its settings: the text below [module.settings], in whose table headers "settings." stands
  /// for "module.settings.".
  RealRigToml& module(const std::string& name, const std::string& file, const std::string& settings) {
    const std::string below = std::regex_replace(settings, std::regex("\\[settings\\."), "[module.settings.");
    modules_ +=
        fmt::format("[[module]]\nname = \"{}\"\nfile = \"{}\"\n[module.settings]\n{}\n", name, file, below);
    return *this;
  }
  /// The part ("axis.pan", "camera") is that device.
  RealRigToml& part(const std::string& part, const std::string& module, const std::string& device) {
    set_in(part, "module", fmt::format("\"{}\"", module));
    return set_in(part, "device", fmt::format("\"{}\"", device));
  }
  RealRigToml& set_in(const std::string& table, const std::string& key, const std::string& value) {
    const auto begin = text_.find("[" + table + "]");
    const auto at = text_.find("\n" + key + " = ", begin);
    EXPECT_NE(begin, std::string::npos) << table;
    EXPECT_NE(at, std::string::npos) << key;
    const auto line_end = text_.find('\n', at + 1);
    text_.replace(at + 1, line_end - at - 1, key + " = " + value);
    return *this;
  }
  RealRigToml& add(const std::string& more) {
    text_ += "\n" + more;
    return *this;
  }
  [[nodiscard]] std::string text() const { return with_modules_first(); }

 private:
  void set(const std::string& from, const std::string& to) {
    const auto at = text_.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text_.replace(at, from.size(), to);
  }
  [[nodiscard]] std::string with_modules_first() const {
    const auto at = text_.find("[axis.roll]");
    return text_.substr(0, at) + modules_ + text_.substr(at);
  }

  std::string text_, modules_;
};

/// Homes, takes a job of so many poses, each in so many attempts, and ends rigd; the scan is whole and
/// proven. Frames by file.
inline std::map<std::string, scan::Frame> scanned_frames(const std::filesystem::path& folder,
                                                         const std::string& rig_toml, int poses,
                                                         int attempts = 3) {
  RunningRig rig(folder, rig_toml);
  if (run_program("rigd", {"--check", "--config", folder / "rig.toml"}, folder / "check.log") != 0) {
    ADD_FAILURE() << bytes_in(folder / "check.log");
    return {};
  }
  rig.start();
  protocol::Request home;
  home.mutable_home();
  rig.expect_done(home);
  rig.submit(tiny_job(poses, attempts));
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  const auto verified = scan::verify_scan(rig.scan(), {});
  EXPECT_TRUE(verified.has_value() && verified->complete()) << rig.log();
  std::map<std::string, scan::Frame> frames;
  for (const auto& [name, bytes] : frames_of(rig.scan())) {
    auto frame = scan::read_frame(rig.scan() / "frames" / name);
    EXPECT_TRUE(frame.has_value()) << name;
    if (frame) frames.emplace(name, std::move(*frame));
  }
  EXPECT_EQ(frames.size(), static_cast<std::size_t>(2 * poses));
  return frames;
}

}  // namespace rig::test
