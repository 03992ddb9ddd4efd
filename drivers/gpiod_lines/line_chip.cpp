#include "drivers/gpiod_lines/line_chip.h"

#include <string_view>

#include "drivers/gpiod_lines/kernel_chip.h"
#include "drivers/gpiod_lines/socket_chip.h"

namespace rig::drivers::gpiod_lines {

Result<std::unique_ptr<LineChip>> open_chip(const std::string& chip,
                                            const std::vector<LineRequest>& requests) {
  if (chip.starts_with(kSocketPrefix)) {
    return open_socket_chip(chip.substr(std::string_view(kSocketPrefix).size()), requests);
  }
  return open_kernel_chip(chip, requests);
}

}  // namespace rig::drivers::gpiod_lines
