// Whether somebody made a file, be it for a moment: the virtual emergency stop, which is never missed between
// two looks.
#pragma once

#include <filesystem>
#include <string>

namespace rig::sim {

class PressWatch {
 public:
  /// Watches for `name` in a folder that exists. Where the kernel has no watch left, only a file that is
  /// there when somebody looks is seen.
  PressWatch(const std::filesystem::path& folder, const std::string& name);
  ~PressWatch();
  PressWatch(const PressWatch&) = delete;
  PressWatch& operator=(const PressWatch&) = delete;

  /// The file is there.
  [[nodiscard]] bool held() const;
  /// It was made since the last call.
  [[nodiscard]] bool made();

 private:
  const std::filesystem::path path_;
  int fd_;
};

}  // namespace rig::sim
