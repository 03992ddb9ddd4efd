#include "clients/rig/access_options.h"

#include <memory>

#include "clients/rig/access.h"

namespace rig::client {

void offer_control(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen) {
  auto* control = app.add_subcommand("control", "who commands the rig; one client at a time");
  control->require_subcommand(1);
  command(*control, "show", "who holds control, and who else is there")->callback([&] {
    chosen = [&] { return control_show(to); };
  });
  command(*control, "take", "take it: where it is free, or as an admin")->callback([&] {
    chosen = [&] { return control_take(to); };
  });
  command(*control, "release", "let others have it")->callback([&] {
    chosen = [&] { return control_release(to); };
  });
  auto* hand_over = command(*control, "hand-over", "give it to another client");
  const auto client = std::make_shared<std::string>();
  hand_over->add_option("client", *client, "its name, as `rig control show` lists it")->required();
  hand_over->callback([&, client] { chosen = [&, client] { return control_hand_over(to, *client); }; });
}

void offer_keys(CLI::App& app, Chosen& chosen) {
  struct Given {
    std::string list = "/etc/rigd/allowed-keys.toml";
    std::string file, name, key, role = "operator";
  };
  const auto given = std::make_shared<Given>();
  auto* keys = app.add_subcommand("keys", "who may connect to rigd over the network");
  keys->require_subcommand(1);
  const auto on_list = [&](const char* name, const char* help) {
    auto* sub = keys->add_subcommand(name, help);
    sub->add_option("--list", given->list, "the file that rig.toml calls network.allow_list")
        ->capture_default_str();
    return sub;
  };
  auto* make = keys->add_subcommand("make", "a new pair of keys, for rigd or for a client");
  make->add_option("file", given->file, "for the secret key; the public one goes beside it, as .pub")
      ->required();
  make->callback([&chosen, given] { chosen = [given] { return keys_make(given->file); }; });
  on_list("list", "the clients that are allowed")->callback([&chosen, given] {
    chosen = [given] { return keys_list(given->list); };
  });
  auto* allow = on_list("allow", "let a client connect");
  allow->add_option("name", given->name, "by which others will know it")->required();
  allow->add_option("key", given->key, "its public key, or the .pub file")->required();
  allow->add_option("--role", given->role, "observer, operator or admin")->capture_default_str();
  allow->callback([&chosen, given] {
    chosen = [given] { return keys_allow(given->list, given->name, given->key, given->role); };
  });
  auto* revoke = on_list("revoke", "shut a client out, also one that is connected");
  revoke->add_option("name", given->name, "of the client, or its public key")->required();
  revoke->callback([&chosen, given] { chosen = [given] { return keys_revoke(given->list, given->name); }; });
}

}  // namespace rig::client
