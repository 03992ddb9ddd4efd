#include "daemon/access.h"

#include "protocol/allow_list.h"
#include "protocol/keys.h"

namespace rig::daemon {

namespace fs = std::filesystem;

protocol::ServerOptions server_options(const Options& options, const machine::AccessConfig& access) {
  protocol::ServerOptions out;
  out.folder = fs::absolute(options.runtime_folder);
  out.observe_group = access.observe_group;
  out.operate_group = access.operate_group;
  if (access.network) {
    const fs::path here = fs::absolute(options.config).parent_path();
    out.network = protocol::NetworkDoor{access.network->endpoint, here / access.network->key_file,
                                        here / access.network->allow_list};
  }
  return out;
}

base::Result<void> check_access(const protocol::ServerOptions& options) {
  if (!options.network) return {};
  if (const auto keys = protocol::read_key_file(options.network->key_file); !keys) return base::pass(keys);
  if (const auto list = protocol::read_allow_list(options.network->allow_list); !list)
    return base::pass(list);
  return {};
}

}  // namespace rig::daemon
