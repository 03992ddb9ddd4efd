#include "clients/rig/access.h"

#include <cstdio>

#include "clients/rig/format.h"
#include "protocol/allow_list.h"
#include "protocol/client.h"
#include "protocol/keys.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

Result<void> ask_about_control(const Connection& to, const protocol::Request& request) {
  auto client = protocol::Client::connect(to.endpoint);
  if (!client) return pass(client);
  const auto reply = client->ask(request, std::chrono::milliseconds(static_cast<long>(to.wait_s * 1e3)));
  if (!reply) return pass(reply);
  if (reply->outcome() != protocol::DONE) {
    const bool refused = reply->outcome() == protocol::REFUSED;
    return fail(refused ? ErrorCode::refused : ErrorCode::device, reply->reason());
  }
  std::printf("%s", describe_control(reply->control()).c_str());
  return {};
}

}  // namespace

Result<void> control_show(const Connection& to) {
  protocol::Request request;
  request.mutable_get_control();
  return ask_about_control(to, request);
}

Result<void> control_take(const Connection& to) {
  protocol::Request request;
  request.mutable_take_control();
  return ask_about_control(to, request);
}

Result<void> control_release(const Connection& to) {
  protocol::Request request;
  request.mutable_release_control();
  return ask_about_control(to, request);
}

Result<void> control_hand_over(const Connection& to, const std::string& client) {
  protocol::Request request;
  request.mutable_hand_over()->set_client(client);
  return ask_about_control(to, request);
}

Result<void> keys_make(const std::filesystem::path& file) {
  const auto keys = protocol::make_key_pair();
  if (!keys) return pass(keys);
  if (auto ok = protocol::write_key_files(file, *keys); !ok) return ok;
  std::printf("%s: secret, stays where it is\n%s.pub: %s\n", file.c_str(), file.c_str(),
              keys->public_key.c_str());
  return {};
}

Result<void> keys_list(const std::filesystem::path& list) {
  const auto keys = protocol::read_allow_list(list);
  if (!keys) return pass(keys);
  for (const auto& key : *keys) {
    std::printf("%-20s %-8s %s\n", key.name.c_str(), protocol::role_name(key.role).c_str(),
                key.public_key.c_str());
  }
  if (keys->empty()) std::printf("nobody is allowed\n");
  return {};
}

Result<void> keys_allow(const std::filesystem::path& list, const std::string& name, const std::string& key,
                        const std::string& role) {
  const auto known_role = protocol::role_named(role);
  if (!known_role) {
    return fail(ErrorCode::bad_input, fmt::format("there is no role '{}'", role), {},
                "observer, operator or admin");
  }
  auto public_key = protocol::read_public_key(key);
  if (!public_key) return pass(public_key);
  return protocol::allow_key(list, {name, std::move(*public_key), *known_role});
}

Result<void> keys_revoke(const std::filesystem::path& list, const std::string& name) {
  const auto gone = protocol::revoke_key(list, name);
  if (!gone) return pass(gone);
  std::printf("'%s' is not allowed any more\n", gone->name.c_str());
  return {};
}

}  // namespace rig::client
