// Whatever registration.toml holds: it is read and written back as the same, or every mistake in it is told.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "calibration/registration_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto read = rig::calibration::parse_registration(text, "registration.toml");
  if (!read) {
    if (read.error().what.empty()) std::abort();
    return 0;
  }
  const std::string written = rig::calibration::format_registration(*read);
  const auto again = rig::calibration::parse_registration(written, "written");
  if (!again || rig::calibration::format_registration(*again) != written) std::abort();
  return 0;
}
