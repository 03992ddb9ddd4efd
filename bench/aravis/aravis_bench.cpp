// bench_aravis: the driver beside Aravis alone, on Aravis' simulated GigE Vision camera in another process.
//
// Rate: both trigger a frame of 2048 x 2048 pixels, wait for it, check every pixel of it and go on with the
// next; in turns, because the machine has other things to do. Loss: with packets lost, no frame that the
// driver hands out may be wrong in a single pixel.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <thread>
#include <vector>

#include "bench/aravis/bare_loop.h"
#include "core/base/clock.h"
#include "core/base/config.h"
#include "drivers/aravis_camera/camera.h"
#include "sim/wire/gv_camera_process.h"
#include "sim/wire/gv_pattern.h"
#include "sim/wire/own_network.h"

namespace {

namespace fs = std::filesystem;
using rig::base::pass;
using rig::base::Result;
using rig::bench::LoopOptions;
using rig::bench::LoopResult;
using Steady = std::chrono::steady_clock;

constexpr int kRounds = 7;
constexpr double kLeastRatio = 0.9;
constexpr double kExposure_s = 1e-3;
constexpr int kLostPerThousand = 4;  // of 72 packets a frame
constexpr int kFramesWithLoss = 300;
constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kPatienceWithLoss = std::chrono::milliseconds(150);

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

bool is_right(const std::optional<rig::sim::wire::PatternFacts>& facts, double exposure_s) {
  return facts && std::abs(facts->exposure_us * 1e-6 - exposure_s) < 1e-6;
}

struct Driver {
  std::unique_ptr<rig::drivers::Camera> camera;
  std::vector<std::uint16_t> pixels;
  std::size_t width = 0;
};

Result<Driver> open_driver(rig::base::Clock& clock) {
  const auto table = rig::base::ConfigTable::parse(
      "address = \"127.0.0.1\"\npixel_format = \"Mono8\"\npacket_size = 60000\nreadout_ms = 0\n"
      "frame_retention_ms = 30\n",
      "bench");
  if (!table) return pass(table);
  auto settings = rig::drivers::aravis::read_settings(*table);
  if (auto fine = table->finish(); !fine) return pass(fine);
  auto camera = rig::drivers::aravis::GenicamCamera::open(
      std::move(settings), clock, [](rig::base::LogLevel, const std::string& text) {
        std::fprintf(stderr, "bench_aravis: %s\n", text.c_str());
      });
  if (!camera) return pass(camera);
  Driver driver;
  driver.camera = std::move(*camera);
  const auto can = driver.camera->capabilities();
  driver.width = static_cast<std::size_t>(can.width);
  driver.pixels.resize(driver.width * static_cast<std::size_t>(can.height));
  return driver;
}

// As rigd does it, but asking more often.
Result<bool> wait_for_frame(Driver& driver, Steady::duration patience) {
  const auto until = Steady::now() + patience;
  while (true) {
    auto frame = driver.camera->fetch(driver.pixels);
    if (!frame) return pass(frame);
    if (*frame) return true;
    if (Steady::now() >= until) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

Result<LoopResult> run_driver(rig::base::Clock& clock, int frames, Steady::duration patience) {
  auto driver = open_driver(clock);
  if (!driver) return pass(driver);
  if (auto armed = driver->camera->arm(); !armed) return pass(armed);
  LoopResult result;
  Steady::time_point first{};
  for (int i = 0; i < frames; ++i) {
    if (auto begun = driver->camera->trigger(kExposure_s, 1); !begun) return pass(begun);
    const auto came = wait_for_frame(*driver, patience);
    if (i == 0) first = Steady::now();
    if (!came || !*came) {
      ++result.lost;
      if (auto ended = driver->camera->abort(); !ended) return pass(ended);
    } else if (is_right(rig::sim::wire::read_pattern(driver->pixels, driver->width, 8), kExposure_s)) {
      ++result.good;
    } else {
      ++result.wrong;
    }
    result.seconds = std::chrono::duration<double>(Steady::now() - first).count();
  }
  return result;
}

Result<LoopResult> run_bare(bool free_run, int frames) {
  LoopOptions options;
  options.free_run = free_run;
  options.frames = frames;
  options.exposure_us = kExposure_s * 1e6;
  const auto width = static_cast<std::size_t>(options.width);
  return rig::bench::run_bare_loop(options, [&](std::span<const std::uint8_t> pixels) {
    return is_right(rig::sim::wire::read_pattern(pixels, width), kExposure_s);
  });
}

struct Rates {
  std::vector<double> bare, driver;
  int bare_lost = 0, driver_lost = 0, wrong = 0;
};

Result<Rates> measure_rates(rig::base::Clock& clock) {
  constexpr int kFrames = 100;
  Rates rates;
  for (int round = 0; round < kRounds; ++round) {
    const auto bare = run_bare(false, kFrames);
    if (!bare) return pass(bare);
    const auto driver = run_driver(clock, kFrames, kPatience);
    if (!driver) return pass(driver);
    rates.bare.push_back(bare->rate());
    rates.driver.push_back(driver->rate());
    rates.bare_lost += bare->lost;
    rates.driver_lost += driver->lost;
    rates.wrong += bare->wrong + driver->wrong;
  }
  return rates;
}

Result<bool> run(const fs::path& program) {
  bool kept = true;
  const auto clock = rig::base::make_system_clock();
  auto camera = rig::sim::wire::GvCameraProcess::start(program);
  if (!camera) return pass(camera);
  const auto rates = measure_rates(*clock);
  if (!rates) return pass(rates);
  const double bare = median(rates->bare), driver = median(rates->driver), ratio = driver / bare;
  std::printf(
      "2048 x 2048, 8 bits, a software trigger a frame, every pixel checked; medians of %d rounds in turns\n",
      kRounds);
  std::printf("  Aravis alone  %6.1f frames/s, %d lost\n", bare, rates->bare_lost);
  std::printf("  driver        %6.1f frames/s, %d lost\n", driver, rates->driver_lost);
  std::printf("  ratio         %6.3f (at least %g), wrong %d\n", ratio, kLeastRatio, rates->wrong);
  kept = kept && ratio >= kLeastRatio && rates->driver_lost == 0 && rates->wrong == 0;
  const auto free = run_bare(true, 100);
  if (!free) return pass(free);
  std::printf("  Aravis alone, camera running free: %.1f frames/s, %d of 100 lost on the way\n", free->rate(),
              free->lost);

  if (!camera->command("lose " + std::to_string(kLostPerThousand))) {
    return rig::base::fail(rig::base::ErrorCode::io, "the camera does not obey", program.string());
  }
  const auto lossy = run_driver(*clock, kFramesWithLoss, kPatienceWithLoss);
  if (!lossy) return pass(lossy);
  std::printf(
      "with %d packets in a thousand lost: %d frames whole, %d refused or missing, %d wrong ones handed "
      "out\n",
      kLostPerThousand, lossy->good, lossy->lost, lossy->wrong);
  kept = kept && lossy->wrong == 0 && lossy->lost > 0 && lossy->good > 0;
  return kept;
}

}  // namespace

int main() {
  (void)rig::sim::wire::enter_own_network();
  const auto kept = run(fs::canonical("/proc/self/exe").parent_path() / "rig-sim-gv-camera");
  if (!kept) {
    std::fprintf(stderr, "bench_aravis: %s\n", kept.error().text().c_str());
    return 1;
  }
  if (!*kept) std::fprintf(stderr, "bench_aravis: a bound was missed\n");
  return *kept ? 0 : 1;
}
