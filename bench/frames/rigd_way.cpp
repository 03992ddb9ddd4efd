#include <fmt/format.h>
#include <string>

#include "bench/frames/ways.h"
#include "core/base/files.h"
#include "protocol/frame_reader.h"
#include "tests/soak/tiny_rig.h"

namespace rig::bench {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr std::chrono::seconds kPatience{60};

Result<std::string> rig_toml() {
  auto shipped = base::read_file(fs::path(RIG_SOURCE_DIR) / "share/virtual/rig.toml");
  if (!shipped) return shipped;
  return soak::changed(std::move(*shipped), {{"clock = \"discrete-event\"", "clock = \"system\""},
                                             {"width = 1600", fmt::format("width = {}", kWidth)},
                                             {"height = 1200", fmt::format("height = {}", kHeight)},
                                             {"fx_px = 6000.0", "fx_px = 15360.0"},
                                             {"fy_px = 6000.0", "fy_px = 15360.0"},
                                             {"cx_px = 803.2", "cx_px = 2056.2"},
                                             {"cy_px = 596.4", "cy_px = 1526.8"},
                                             {"readout_ms = 500.0", "readout_ms = 500.0\nrender = \"hash\""},
                                             {"warm_up_s = 900.0", "warm_up_s = 900.0\nwarm_at_start = true"},
                                             {"settle_ms = 300", "settle_ms = 20"}});
}

// Poses side by side, so that most of the time passes in exposing.
std::string job_toml(int poses) {
  std::string text =
      "format = 1\nname = \"bench\"\nsample = \"chart\"\n\n[exposure]\nstrategy = \"fixed\"\n"
      "exposures_us = [12000, 9000]\n\n[poses]\nangles_deg = [\n";
  for (int i = 0; i < poses; ++i) text += fmt::format("  [{}, 10, 20, 90],\n", i % 2);
  return text + "]\n";
}

// The next frame, to a client that has mapped nothing before; how old it was when its first and its last
// sample were read. Nothing where rigd wrote the memory anew meanwhile.
Result<std::optional<Steady::duration>> see(const fs::path& socket) {
  auto reader = protocol::FrameReader::connect(socket);
  if (!reader) return pass(reader);
  const auto frame = reader->next(kPatience);
  if (!frame) return pass(frame);
  if (!*frame) return fail(ErrorCode::timeout, "rigd takes no frame");
  const protocol::SeenFrame& seen = **frame;
  const volatile unsigned read = unsigned{seen.pixels.front()} + seen.pixels.back();
  (void)read;
  const auto now = Steady::now();
  if (seen.pixels.size() != std::size_t{kWidth} * kHeight)
    return fail(ErrorCode::damaged, "a frame of another size");
  if (!seen.intact()) return std::optional<Steady::duration>();
  return now - Steady::time_point(std::chrono::nanoseconds(seen.facts.complete_ns()));
}

}  // namespace

Result<RigdWay> RigdWay::open(const fs::path& folder, int frames) {
  fs::create_directories(folder);
  const auto text = rig_toml();
  if (!text) return base::pass(text);
  if (auto ok = base::write_file_durably(folder / "rig.toml", *text); !ok) return base::pass(ok);
  auto process =
      soak::RigProcess::start(fs::read_symlink("/proc/self/exe").parent_path() / "rigd", folder, {});
  if (!process) return base::pass(process);
  protocol::Request submit;
  submit.mutable_submit_job()->set_job_toml(job_toml(frames));
  submit.mutable_submit_job()->set_job_name("job.toml");
  submit.mutable_submit_job()->set_scan_folder((folder / "scan").string());
  const auto reply = process->ask(submit);
  if (!reply) return base::pass(reply);
  if (!*reply || (*reply)->outcome() != protocol::DONE)
    return fail(ErrorCode::refused, *reply ? (*reply)->reason() : "rigd died",
                (folder / "rigd.log").string());
  RigdWay way(folder / "run" / "frames.sock", std::move(*process));
  if (auto first = see(way.socket_); !first) return base::pass(first);
  return way;
}

Result<Steady::duration> RigdWay::pass() {
  while (true) {
    const auto age = see(socket_);
    if (!age) return base::pass(age);
    if (*age) return **age;
  }
}

}  // namespace rig::bench
