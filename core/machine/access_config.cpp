#include "core/machine/access_config.h"

#include <charconv>
#include <string_view>

namespace rig::machine {

namespace {

constexpr int kHighestPort = 65535;

// "tcp://ADDRESS:PORT"; ADDRESS may be * and hold colons in brackets, PORT may be *.
bool is_tcp_endpoint(std::string_view endpoint) {
  constexpr std::string_view kScheme = "tcp://";
  const auto colon = endpoint.rfind(':');
  if (!endpoint.starts_with(kScheme) || colon == std::string_view::npos || colon <= kScheme.size())
    return false;
  const std::string_view port = endpoint.substr(colon + 1);
  if (port == "*") return true;
  int number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  return error == std::errc() && end == port.data() + port.size() && number >= 1 && number <= kHighestPort;
}

}  // namespace

AccessConfig read_access(const base::ConfigTable& root) {
  AccessConfig access;
  if (const auto network = root.table_if("network")) {
    access.network =
        NetworkConfig{network->text("endpoint"), network->text("key_file"), network->text("allow_list")};
    if (!is_tcp_endpoint(access.network->endpoint))
      network->error("endpoint", "is not of the form tcp://ADDRESS:PORT", "tcp://0.0.0.0:4400");
    if (access.network->key_file.empty()) network->error("key_file", "names no file");
    if (access.network->allow_list.empty()) network->error("allow_list", "names no file");
  }
  if (const auto sockets = root.table_if("sockets")) {
    access.observe_group = sockets->text_or("observe_group", "");
    access.operate_group = sockets->text_or("operate_group", "");
  }
  if (const auto control = root.table_if("control"))
    access.release_after_s = control->number_or("release_after_s", access.release_after_s, {5, 86400});
  return access;
}

}  // namespace rig::machine
