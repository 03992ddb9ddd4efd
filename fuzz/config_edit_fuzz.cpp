// Changing one value in a text that a person wrote: it is changed there and nowhere else, or refused in
// words.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "core/base/config.h"
#include "core/base/config_edit.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto edited =
      rig::base::edit_toml_value(text, {"module", "name=virtual", "settings", "axis", "pan", "low_deg"}, 1.5);
  if (!edited) {
    if (edited.error().what.empty()) std::abort();
    return 0;
  }
  // The same change once more has nothing to do.
  const auto again = rig::base::edit_toml_value(
      *edited, {"module", "name=virtual", "settings", "axis", "pan", "low_deg"}, 1.5);
  if (!again || *again != *edited) std::abort();
  const auto lines = [](std::string_view s) { return std::count(s.begin(), s.end(), '\n'); };
  if (lines(*edited) < lines(text)) std::abort();
  return 0;
}
