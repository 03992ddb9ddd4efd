#include "bench/protocol/busy_rig.h"

#include <array>
#include <fstream>
#include <regex>
#include <string>
#include <thread>

#include "core/base/files.h"
#include "core/machine/pose.h"
#include "protocol/allow_list.h"
#include "protocol/envelope.h"
#include "tests/soak/tiny_rig.h"

namespace rig::bench {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

constexpr seconds kPatience{30};

// Frames of 800 x 600, whose previews of 400 x 300 are as large as any get, about ten times a second.
Result<std::string> rig_toml() {
  auto shipped = base::read_file(fs::path(RIG_SOURCE_DIR) / "share/virtual/rig.toml");
  if (!shipped) return shipped;
  auto text = soak::changed(*shipped, {{"clock = \"discrete-event\"", "clock = \"system\""},
                                       {"seed = 1", "seed = 1\nwire_log = \"wire.log\""},
                                       {"width = 1600", "width = 800"},
                                       {"height = 1200", "height = 600"},
                                       {"fx_px = 6000.0", "fx_px = 3000.0"},
                                       {"fy_px = 6000.0", "fy_px = 3000.0"},
                                       {"cx_px = 803.2", "cx_px = 401.6"},
                                       {"cy_px = 596.4", "cy_px = 298.2"},
                                       {"readout_ms = 500.0", "readout_ms = 80.0\nrender = \"hash\""},
                                       {"warm_up_s = 900.0", "warm_up_s = 900.0\nwarm_at_start = true"},
                                       {"settle_ms = 300", "settle_ms = 20"},
                                       {"approach_deg = 2.0", "approach_deg = 0.0"},
                                       {"approach_deg = 1.0", "approach_deg = 0.0"}});
  if (!text) return text;
  return *text +
         "\n[network]\nendpoint = \"tcp://127.0.0.1:*\"\nkey_file = \"rigd.key\"\n"
         "allow_list = \"allowed.toml\"\n";
}

// Poses side by side, eight exposures each.
std::string job_toml() {
  constexpr int kPoses = 1500;  // more than half an hour
  std::string text =
      "format = 1\nname = \"bench\"\nsample = \"chart\"\n\n[exposure]\nstrategy = \"fixed\"\n"
      "exposures_us = [12000, 11500, 11000, 10500, 10000, 9500, 9000, 8500]\n\n[poses]\nangles_deg = [\n";
  for (int i = 0; i < kPoses; ++i) {
    const int side = i % 2 == 0 ? 0 : 1;
    text += fmt::format("  [{}, {}, {}, 90],\n", side, 10 + side, 20 + side);
  }
  return text + "]\n";
}

Result<std::string> endpoint_in(const fs::path& log) {
  const std::regex wanted("tcp://127\\.0\\.0\\.1:[0-9]+");
  const auto until = Steady::now() + kPatience;
  while (Steady::now() < until) {
    const auto text = base::read_file(log);
    std::smatch found;
    if (text && std::regex_search(*text, found, wanted)) return found.str();
    std::this_thread::sleep_for(milliseconds(10));
  }
  return fail(ErrorCode::timeout, "rigd does not listen on the network", log.string());
}

Result<protocol::Reply> done(Result<protocol::Reply> reply) {
  if (reply && reply->outcome() != protocol::DONE) return fail(ErrorCode::refused, reply->reason());
  return reply;
}

}  // namespace

Result<BusyRig> BusyRig::start(const fs::path& folder) {
  fs::create_directories(folder);
  const auto own = protocol::make_key_pair();
  if (!own) return pass(own);
  const auto server = protocol::make_key_pair();
  if (!server) return pass(server);
  if (auto ok = protocol::write_key_files(folder / "rigd.key", *server); !ok) return pass(ok);
  if (auto ok =
          protocol::allow_key(folder / "allowed.toml", {"bench", own->public_key, protocol::Role::operator_});
      !ok) {
    return pass(ok);
  }
  const auto text = rig_toml();
  if (!text) return pass(text);
  if (auto ok = base::write_file_durably(folder / "rig.toml", *text); !ok) return pass(ok);
  auto process =
      soak::RigProcess::start(fs::read_symlink("/proc/self/exe").parent_path() / "rigd", folder, {});
  if (!process) return pass(process);
  const auto endpoint = endpoint_in(folder / "rigd.log");
  if (!endpoint) return pass(endpoint);
  auto client = protocol::Client::connect(*endpoint, {*own, server->public_key});
  if (!client) return pass(client);
  BusyRig rig(std::move(*process), std::move(*client), folder / "state/virtual/wire.log");
  protocol::Request subscribe;
  subscribe.mutable_subscribe()->set_previews(true);
  protocol::Request submit;
  submit.mutable_submit_job()->set_job_toml(job_toml());
  submit.mutable_submit_job()->set_job_name("job.toml");
  submit.mutable_submit_job()->set_scan_folder((folder / "scan").string());
  for (const auto& request : {subscribe, submit}) {
    if (auto reply = rig.ask(request); !reply) return pass(reply);
  }
  if (auto first = rig.next_preview(); !first) return pass(first);
  return rig;
}

Result<protocol::Reply> BusyRig::ask(const protocol::Request& request) {
  return done(client_.ask(request, kPatience));
}

Result<protocol::Reply> BusyRig::ask_locally(const protocol::Request& request) {
  auto reply = process_.ask(request);
  if (!reply) return pass(reply);
  if (!*reply) return fail(ErrorCode::device, "rigd died");
  return done(std::move(**reply));
}

bool BusyRig::pass_until(Steady::time_point time) {
  while (Steady::now() < time) {
    const auto event = client_.next_event(std::chrono::ceil<milliseconds>(time - Steady::now()));
    if (!event) return false;
    if (*event && (*event)->has_preview()) ++previews_;
  }
  return true;
}

Result<std::size_t> BusyRig::next_preview() {
  const auto until = Steady::now() + kPatience;
  while (Steady::now() < until) {
    auto event = client_.next_event(std::chrono::ceil<milliseconds>(until - Steady::now()));
    if (!event) return pass(event);
    if (!*event || !(*event)->has_preview()) continue;
    ++previews_;
    protocol::Message message;
    message.set_version(protocol::kVersion);
    *message.mutable_event() = std::move(**event);
    return message.ByteSizeLong();
  }
  return fail(ErrorCode::timeout, "no preview comes");
}

Result<void> BusyRig::hold() {
  protocol::Request hold;
  hold.mutable_hold_job()->set_job(1);
  if (auto reply = ask(hold); !reply) return pass(reply);
  protocol::Request look;
  look.mutable_get_status();
  const auto until = Steady::now() + kPatience;
  while (Steady::now() < until) {
    const auto reply = ask(look);
    if (!reply) return pass(reply);
    if (reply->status().job().resting()) return {};
    pass_until(Steady::now() + milliseconds(20));
  }
  return fail(ErrorCode::timeout, "the job does not come to rest");
}

Result<void> BusyRig::release() {
  pass_until(Steady::now() + milliseconds(20));  // what is left of the stream before
  protocol::Request release;
  release.mutable_release_job()->set_job(1);
  if (auto reply = ask(release); !reply) return pass(reply);
  if (auto seen = next_preview(); !seen) return pass(seen);
  return {};
}

Result<Steady::time_point> BusyRig::last_stop_after(Steady::time_point sent) {
  const auto until = Steady::now() + kPatience;
  while (Steady::now() < until) {
    std::ifstream log(wire_log_);
    log.seekg(wire_read_);
    std::size_t stops = 0;
    Steady::time_point last;
    std::streamoff end = wire_read_;
    for (std::string line; stops < machine::kAxisCount && std::getline(log, line);) {
      const Steady::time_point at{std::chrono::nanoseconds(std::stoll(line))};
      end += static_cast<std::streamoff>(line.size()) + 1;
      if (at < sent) continue;
      last = std::max(last, at);
      ++stops;
    }
    if (stops == machine::kAxisCount) {
      wire_read_ = end;
      return last;
    }
    std::this_thread::sleep_for(milliseconds(1));
  }
  return fail(ErrorCode::timeout, "no stop reaches the axes", wire_log_.string());
}

Result<Steady::duration> BusyRig::stop_and_go_on() {
  protocol::Request stop;
  stop.mutable_stop()->set_reason("bench");
  const auto sent = Steady::now();
  if (auto reply = ask(stop); !reply) return pass(reply);
  const auto on_the_wire = last_stop_after(sent);
  if (!on_the_wire) return pass(on_the_wire);
  protocol::Request clear;
  clear.mutable_clear_stop();
  if (auto reply = ask(clear); !reply) return pass(reply);
  // Previews from before the stop are not what is waited for.
  pass_until(Steady::now() + milliseconds(20));
  if (auto seen = next_preview(); !seen) return pass(seen);
  return *on_the_wire - sent;
}

}  // namespace rig::bench
