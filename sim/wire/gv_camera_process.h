// rig-sim-gv-camera, started and told what to do.
#pragma once

#include <filesystem>
#include <string>
#include <sys/types.h>
#include <vector>

#include "core/base/result.h"

namespace rig::sim::wire {

/// Ends with this object.
class GvCameraProcess {
 public:
  /// `program` is the path of rig-sim-gv-camera. Returns once it answers on its network. Errors: io.
  [[nodiscard]] static base::Result<GvCameraProcess> start(const std::filesystem::path& program,
                                                           const std::vector<std::string>& arguments = {});
  GvCameraProcess(GvCameraProcess&& other) noexcept;
  GvCameraProcess& operator=(GvCameraProcess&&) = delete;
  ~GvCameraProcess();

  /// One of its commands; false where it refused.
  bool command(const std::string& line);

 private:
  GvCameraProcess(pid_t pid, int line) : pid_(pid), line_(line) {}
  [[nodiscard]] std::string read_line();

  pid_t pid_;
  int line_;  // its input and output
};

}  // namespace rig::sim::wire
