#include "daemon/lease.h"

#include <algorithm>

#include "daemon/messages.h"

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::Result;
using protocol::Request;

namespace {

double silent_s(const State& state, const Presence& presence) {
  return base::to_seconds(state.wall - presence.heard);
}

void give(State& state, Actions& actions, const std::string& to, const std::string& reason) {
  if (state.lease.holder == to) return;
  protocol::Event event;
  event.mutable_control_changed()->set_previous(state.lease.holder);
  event.mutable_control_changed()->set_holder(to);
  event.mutable_control_changed()->set_reason(reason);
  state.lease.holder = to;
  actions.push_back(SaveLease{to});
  publish(state, actions, std::move(event));
}

tl::unexpected<base::Error> held_by_another(const State& state) {
  const auto holder = state.lease.present.find(state.lease.holder);
  const double ago = holder == state.lease.present.end() ? 0 : silent_s(state, holder->second);
  return fail(ErrorCode::refused,
              fmt::format("'{}' holds control, last heard of {:.0f} s ago", state.lease.holder, ago), {},
              "it can hand over, and an admin can take control");
}

Result<void> take(State& state, Actions& actions, const RequestReceived& received) {
  const std::string& holder = state.lease.holder;
  if (holder.empty() || holder == received.who) {
    give(state, actions, received.who, "asked for");
    return {};
  }
  if (received.role != protocol::Role::admin) return held_by_another(state);
  give(state, actions, received.who, "taken by an admin");
  return {};
}

// Its own, or as an admin anybody's.
Result<void> may_give_away(const State& state, const RequestReceived& received) {
  if (state.lease.holder.empty()) return fail(ErrorCode::refused, "nobody holds control");
  if (state.lease.holder == received.who || received.role == protocol::Role::admin) return {};
  return held_by_another(state);
}

Result<void> hand_over(State& state, Actions& actions, const RequestReceived& received) {
  if (auto ok = may_give_away(state, received); !ok) return ok;
  const std::string& to = received.request.hand_over().client();
  const auto found = state.lease.present.find(to);
  if (found == state.lease.present.end()) {
    return fail(ErrorCode::refused, fmt::format("no client '{}' was heard of lately", to), {},
                "it has to ask for something first; `rig control` lists those who are there");
  }
  if (found->second.role == protocol::Role::observer) {
    return fail(ErrorCode::refused, fmt::format("'{}' may look and stop, not command", to));
  }
  give(state, actions, to, fmt::format("handed over by '{}'", received.who));
  return {};
}

}  // namespace

void hear(const Setup& setup, State& state, Actions& actions, const RequestReceived& received) {
  // Who comes back too late has lost it before it is heard.
  release_silent(setup, state, actions);
  // One person may be here through two sockets: what counts is what it may do by the better one.
  const auto [at, fresh] = state.lease.present.try_emplace(received.who);
  at->second = {std::max(at->second.role, received.role), state.wall};
}

void release_silent(const Setup& setup, State& state, Actions& actions) {
  Lease& lease = state.lease;
  if (!lease.holder.empty()) {
    // One that is known from before a restart has the full time to come back.
    const auto [holder, unknown] =
        lease.present.try_emplace(lease.holder, Presence{protocol::Role::operator_, state.wall});
    const bool waits = state.snap.has_value() || (state.motion && state.motion->asker);
    if (waits) holder->second.heard = state.wall;
  }
  const double limit_s = setup.rig.access.release_after_s;
  for (auto it = lease.present.begin(); it != lease.present.end();) {
    if (silent_s(state, it->second) <= limit_s) {
      ++it;
      continue;
    }
    const bool held = it->first == lease.holder;
    it = lease.present.erase(it);
    if (held) give(state, actions, "", fmt::format("not heard of for {:.0f} s", limit_s));
  }
}

Result<void> use_control(State& state, Actions& actions, const RequestReceived& received) {
  const std::string& holder = state.lease.holder;
  if (!holder.empty() && holder != received.who) return held_by_another(state);
  give(state, actions, received.who, "by a first command");
  return {};
}

bool is_about_control(const Request& request) {
  switch (request.command_case()) {
    case Request::kTakeControl:
    case Request::kReleaseControl:
    case Request::kHandOver:
    case Request::kGetControl:
      return true;
    default:
      return false;
  }
}

void on_control_request(const Setup& setup, State& state, Actions& actions, const RequestReceived& received) {
  const Request& request = received.request;
  Result<void> done;
  if (request.has_take_control()) done = take(state, actions, received);
  if (request.has_hand_over()) done = hand_over(state, actions, received);
  if (request.has_release_control()) {
    done = may_give_away(state, received);
    if (done) give(state, actions, "", fmt::format("released by '{}'", received.who));
  }
  auto reply = done ? make_reply(request.id(), protocol::DONE)
                    : make_reply(request.id(), protocol::REFUSED, done.error().text());
  *reply.mutable_control() = make_control(setup, state);
  reply.mutable_control()->set_you(received.who);
  actions.push_back(SendReply{received.client, std::move(reply)});
}

void on_client_revoked(State& state, Actions& actions, const ClientRevoked& revoked) {
  state.lease.present.erase(revoked.who);
  if (state.lease.holder == revoked.who) give(state, actions, "", "its key was revoked");
}

protocol::Control make_control(const Setup& setup, const State& state) {
  protocol::Control control;
  control.set_holder(state.lease.holder);
  control.set_release_after_s(setup.rig.access.release_after_s);
  for (const auto& [name, presence] : state.lease.present) {
    auto& client = *control.add_clients();
    client.set_name(name);
    client.set_role(protocol::role_name(presence.role));
    client.set_heard_s_ago(silent_s(state, presence));
    if (name == state.lease.holder) control.set_heard_s_ago(silent_s(state, presence));
  }
  return control;
}

}  // namespace rig::daemon
