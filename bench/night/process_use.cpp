#include "bench/night/process_use.h"

#include <fstream>
#include <sstream>
#include <string>
#include <unistd.h>

namespace rig::bench {

double resident_MiB(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stod(line.substr(6)) / 1024;
  }
  return 0;
}

double processor_s(pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(stat, line);
  // The name may hold blanks and ends with a parenthesis. proc(5): utime and stime are the 14th and the 15th,
  // the state behind the name the 3rd.
  const auto name_ends = line.rfind(')');
  if (name_ends == std::string::npos) return 0;
  std::istringstream fields(line.substr(name_ends + 1));
  constexpr int kSkipped = 11;
  std::string skipped;
  for (int i = 0; i < kSkipped; ++i) fields >> skipped;
  double user = 0;
  double system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace rig::bench
