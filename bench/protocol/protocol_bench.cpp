// How long rigd takes to answer and to stop, over TCP with CURVE while previews come, beside a bare ZeroMQ
// echo with the same keys, sizes and stream; and the answer beside INDI's server, which encrypts nothing. The
// sides take turns in short blocks, so that what else the machine does hits both.
#include <cstdio>
#include <thread>
#include <unistd.h>

#include "bench/base/latencies.h"
#include "bench/indi/indi_peer.h"
#include "bench/protocol/busy_rig.h"
#include "bench/protocol/echo.h"
#include "core/base/command_line.h"
#include "core/base/random.h"
#include "protocol/envelope.h"

namespace {

namespace fs = std::filesystem;
using namespace rig;
using bench::BusyRig;
using bench::Latencies;
using bench::Steady;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kPace{5};  // between requests, as an attentive program asks
constexpr double kMostAnswerRatio = 2;
constexpr double kMostStopRatio = 3;

struct Options {
  int blocks = 12;
  int stops_per_block = 20;
};

protocol::Request status_request() {
  protocol::Request request;
  request.mutable_get_status();
  return request;
}

bool within(const char* what, double ratio, double most) {
  std::printf("  %-34s %6.2f  (at most %g)%s\n", what, ratio, most, ratio <= most ? "" : "  TOO MUCH");
  return ratio <= most;
}

void print(const char* name, const Latencies& latencies) {
  std::printf("  %-34s p50 %7.0f us   p99 %7.0f us   of %zu\n", name, latencies.quantile_us(0.5),
              latencies.quantile_us(0.99), latencies.count());
}

// Sizes and pace of what rigd sends, for the echo.
base::Result<bench::EchoSizes> sizes_of(BusyRig& rig) {
  constexpr int kPreviews = 40;
  bench::EchoSizes sizes;
  const auto begin = Steady::now();
  for (int i = 0; i < kPreviews; ++i) {
    auto size = rig.next_preview();
    if (!size) return base::pass(size);
    sizes.preview_bytes = *size;
  }
  sizes.preview_every = (Steady::now() - begin) / kPreviews;
  protocol::Request request = status_request();
  auto reply = rig.ask(request);
  if (!reply) return base::pass(reply);
  request.set_version(protocol::kVersion);
  request.set_id(1);
  sizes.request_bytes = request.ByteSizeLong();
  protocol::Message message;
  message.set_version(protocol::kVersion);
  *message.mutable_reply() = std::move(*reply);
  sizes.reply_bytes = message.ByteSizeLong();
  return sizes;
}

base::Result<bool> beside_echo(BusyRig& rig, const bench::EchoServer& server, const Options& options) {
  const auto sizes = sizes_of(rig);
  if (!sizes) return base::pass(sizes);
  server.order(*sizes, false);
  bench::EchoClient echo(server, *sizes);
  Latencies ours;
  Latencies echoed;
  Latencies beside_capture;
  Latencies stops;
  base::Random random(1);
  const auto request = status_request();
  constexpr seconds kBlock{2};
  std::size_t our_previews = 0;
  const auto echo_block = [&](Latencies& latencies) {
    server.order(*sizes, true);
    const bool answered = bench::measure_block(
        latencies, kBlock, kPace, [&] { return echo.ask(); },
        [&](Steady::time_point time) { return echo.pass_until(time); });
    server.order(*sizes, false);
    return answered;
  };
  for (int i = 0; i < options.blocks; ++i) {
    const std::size_t before = rig.previews();
    if (!bench::measure_block(
            ours, kBlock, kPace, [&] { return rig.ask(request).has_value(); },
            [&](Steady::time_point time) { return rig.pass_until(time); })) {
      return base::fail(base::ErrorCode::timeout, "rigd does not answer");
    }
    our_previews += rig.previews() - before;
    for (int k = 0; k < options.stops_per_block; ++k) {
      // At any moment of a pose: on the way, exposing, reading out, storing.
      rig.pass_until(Steady::now() + milliseconds(random.below(600)));
      const auto took = rig.stop_and_go_on();
      if (!took) return base::pass(took);
      stops.add(*took);
    }
    // What a capture takes of the cores is in rigd's figures. The echo is asked beside it too, to tell that
    // from what rigd takes to answer.
    if (!echo_block(beside_capture)) return base::fail(base::ErrorCode::timeout, "the echo does not answer");
    if (auto ok = rig.hold(); !ok) return base::pass(ok);
    if (!echo_block(echoed)) return base::fail(base::ErrorCode::timeout, "the echo does not answer");
    if (auto ok = rig.release(); !ok) return base::pass(ok);
  }
  std::printf(
      "TCP with CURVE, previews of %zu bytes beside: %zu came from rigd, %zu from the echo in twice the "
      "time\n",
      sizes->preview_bytes, our_previews, echo.previews());
  print("GetStatus of rigd", ours);
  print("echo of the same sizes", echoed);
  print("the same while rigd captures", beside_capture);
  print("a stop, until it is on the wire", stops);
  bool fine =
      within("GetStatus over echo, p50", ours.quantile_us(0.5) / echoed.quantile_us(0.5), kMostAnswerRatio);
  fine &=
      within("GetStatus over echo, p99", ours.quantile_us(0.99) / echoed.quantile_us(0.99), kMostAnswerRatio);
  std::printf("  %-34s p50 %.2f, p99 %.2f\n", "GetStatus over echo, both capturing",
              ours.quantile_us(0.5) / beside_capture.quantile_us(0.5),
              ours.quantile_us(0.99) / beside_capture.quantile_us(0.99));
  fine &= within("stop over echo, p99", stops.quantile_us(0.99) / echoed.quantile_us(0.99), kMostStopRatio);
  return fine;
}

base::Result<void> beside_indi(BusyRig& rig, const fs::path& folder, const Options& options) {
  auto indi = bench::IndiPeer::start("indi_simulator_telescope", folder);
  if (!indi) {
    std::printf("INDI: skipped, %s\n", indi.error().text().c_str());
    return {};
  }
  if (auto ok = rig.hold(); !ok) return ok;
  Latencies with_curve;
  Latencies locally;
  Latencies theirs;
  const auto request = status_request();
  const auto ask_indi = [&] {
    return indi->send("<getProperties version='1.7' device='Telescope Simulator' name='CONNECTION'/>") &&
           indi->read_to("</defSwitchVector>", seconds(10));
  };
  // The driver tells of its properties once it has heard of a client.
  if (!ask_indi()) return base::fail(base::ErrorCode::timeout, "INDI's simulator does not answer");
  const auto sleep_until = [](Steady::time_point time) {
    std::this_thread::sleep_until(time);
    return true;
  };
  constexpr seconds kBlock{1};
  for (int i = 0; i < options.blocks; ++i) {
    const bool answered =
        bench::measure_block(
            with_curve, kBlock, kPace, [&] { return rig.ask(request).has_value(); }, sleep_until) &&
        bench::measure_block(
            locally, kBlock, kPace, [&] { return rig.ask_locally(request).has_value(); }, sleep_until) &&
        bench::measure_block(theirs, kBlock, kPace, ask_indi, sleep_until);
    if (!answered) return base::fail(base::ErrorCode::timeout, "no answer");
  }
  std::printf("A question while nothing else happens\n");
  print("GetStatus of rigd, TCP with CURVE", with_curve);
  print("GetStatus of rigd, local socket", locally);
  print("getProperties of INDI, plain TCP", theirs);
  std::printf("  INDI over rigd: p50 %.2f with CURVE, %.2f locally; p99 %.2f and %.2f\n",
              theirs.quantile_us(0.5) / with_curve.quantile_us(0.5),
              theirs.quantile_us(0.5) / locally.quantile_us(0.5),
              theirs.quantile_us(0.99) / with_curve.quantile_us(0.99),
              theirs.quantile_us(0.99) / locally.quantile_us(0.99));
  return {};
}

base::Result<bool> run(const fs::path& folder, const Options& options) {
  const auto echo = bench::EchoServer::start();
  if (!echo) return base::pass(echo);
  auto rig = BusyRig::start(folder / "rig");
  if (!rig) return base::pass(rig);
  auto fine = beside_echo(*rig, *echo, options);
  if (!fine) return fine;
  if (auto ok = beside_indi(*rig, folder / "indi", options); !ok) return base::pass(ok);
  return fine;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"how long rigd takes to answer and to stop, beside a bare ZeroMQ echo and beside INDI"};
  app.add_option("--blocks", options.blocks, "of each side")->check(CLI::Range(1, 1000));
  app.add_option("--stops", options.stops_per_block, "after each block of rigd's")
      ->check(CLI::Range(1, 1000));
  if (const auto status = base::parse_command_line(app, argc, argv)) return *status;
  const fs::path folder = fs::current_path() / fmt::format("bench-protocol-{}", ::getpid());
  const auto fine = run(folder, options);
  std::error_code left_behind;
  fs::remove_all(folder, left_behind);
  if (!fine) {
    std::fprintf(stderr, "bench_protocol: %s\n", fine.error().text().c_str());
    return 1;
  }
  return *fine ? 0 : 1;
}
