// bench_aravis: the driver beside Aravis alone, on Aravis' simulated GigE Vision camera in another process.
//
// Rate: both trigger a frame of 2048 x 2048 pixels, wait for it, check every pixel of it and go on with the
// next; in turns. What else the machine does can only slow a round down, so the best rounds are compared.
// Loss: with packets lost, no frame that the driver hands out may be wrong in a single pixel.
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

constexpr int kRounds = 25;
constexpr int kFrames = 60;  // a round
constexpr double kLeastRatio = 0.9;
constexpr double kExposure_s = 10e-3;  // of which Aravis' ramp is exactly place and frame
constexpr int kLostPerThousand = 4;    // of 72 packets a frame
constexpr int kFramesWithLoss = 300;
constexpr auto kPatience = std::chrono::seconds(2);
constexpr auto kPatienceWithLoss = std::chrono::milliseconds(150);

// Aravis' own ramp: (x + y + frame) mod 255. Our pattern tells exposure and frame, and costs the camera less.
enum class Picture { ramp, pattern };

template <typename Sample>
bool is_ramp(std::span<const Sample> pixels, std::size_t width) {
  constexpr std::size_t kPeriod = 255;
  std::vector<Sample> ramp(kPeriod + width);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<Sample>(i % kPeriod);
  if (pixels.empty() || pixels.size() % width != 0 || pixels.front() >= kPeriod) return false;
  for (std::size_t y = 0; y * width < pixels.size(); ++y) {
    const auto expected = ramp.begin() + static_cast<std::ptrdiff_t>((pixels.front() + y) % kPeriod);
    const auto line = pixels.subspan(y * width, width);
    if (!std::equal(line.begin(), line.end(), expected)) return false;
  }
  return true;
}

bool is_right(const std::optional<rig::sim::wire::PatternFacts>& facts) {
  return facts && std::abs(facts->exposure_us * 1e-6 - kExposure_s) < 1e-6;
}

bool is_right(Picture picture, std::span<const std::uint8_t> pixels, std::size_t width) {
  return picture == Picture::ramp ? is_ramp(pixels, width)
                                  : is_right(rig::sim::wire::read_pattern(pixels, width));
}

bool is_right(Picture picture, std::span<const std::uint16_t> pixels, std::size_t width) {
  return picture == Picture::ramp ? is_ramp(pixels, width)
                                  : is_right(rig::sim::wire::read_pattern(pixels, width, 8));
}

struct Driver {
  std::unique_ptr<rig::drivers::Camera> camera;
  std::vector<std::uint16_t> pixels;
  std::size_t width = 0;
};

Result<Driver> open_driver(rig::base::Clock& clock, int retention_ms) {
  const auto table = rig::base::ConfigTable::parse(
      "address = \"127.0.0.1\"\npixel_format = \"Mono8\"\npacket_size = 60000\nreadout_ms = 0\n"
      "frame_retention_ms = " +
          std::to_string(retention_ms),
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
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
}

Result<LoopResult> run_driver(rig::base::Clock& clock, Picture picture, int frames, Steady::duration patience,
                              int retention_ms) {
  auto driver = open_driver(clock, retention_ms);
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
    } else if (is_right(picture, std::span<const std::uint16_t>(driver->pixels), driver->width)) {
      ++result.good;
    } else {
      ++result.wrong;
    }
    result.seconds = std::chrono::duration<double>(Steady::now() - first).count();
  }
  return result;
}

Result<LoopResult> run_bare(Picture picture, bool free_run, int frames) {
  LoopOptions options;
  options.free_run = free_run;
  options.frames = frames;
  options.exposure_us = kExposure_s * 1e6;
  const auto width = static_cast<std::size_t>(options.width);
  return rig::bench::run_bare_loop(
      options, [&](std::span<const std::uint8_t> pixels) { return is_right(picture, pixels, width); });
}

struct Rates {
  double bare = 0, driver = 0;  // of the best rounds
  int bare_lost = 0, driver_lost = 0, wrong = 0;
};

Result<Rates> measure_rates(rig::base::Clock& clock, Picture picture) {
  constexpr int kRetention_ms = 500;
  Rates rates;
  for (int round = 0; round < kRounds; ++round) {
    const auto bare = run_bare(picture, false, kFrames);
    if (!bare) return pass(bare);
    const auto driver = run_driver(clock, picture, kFrames, kPatience, kRetention_ms);
    if (!driver) return pass(driver);
    rates.bare = std::max(rates.bare, bare->rate());
    rates.driver = std::max(rates.driver, driver->rate());
    rates.bare_lost += bare->lost;
    rates.driver_lost += driver->lost;
    rates.wrong += bare->wrong + driver->wrong;
  }
  return rates;
}

Result<Rates> compare(rig::base::Clock& clock, const fs::path& program, Picture picture, const char* title) {
  const std::vector<std::string> arguments =
      picture == Picture::ramp ? std::vector<std::string>{"--ramp"} : std::vector<std::string>{};
  const auto camera = rig::sim::wire::GvCameraProcess::start(program, arguments);
  if (!camera) return pass(camera);
  auto rates = measure_rates(clock, picture);
  if (!rates) return rates;
  std::printf("%s\n", title);
  std::printf("  Aravis alone   %6.1f frames/s, %d of %d lost\n", rates->bare, rates->bare_lost,
              kRounds * kFrames);
  std::printf("  driver         %6.1f frames/s, %d of %d lost, %d wrong\n", rates->driver, rates->driver_lost,
              kRounds * kFrames, rates->wrong);
  std::printf("  ratio          %6.3f\n", rates->driver / rates->bare);
  const auto free = run_bare(picture, true, 2 * kFrames);
  if (!free) return pass(free);
  std::printf("  Aravis alone, the camera running free: %.1f frames/s, %d of %d lost on the way\n",
              free->rate(), free->lost, 2 * kFrames);
  return rates;
}

Result<bool> run(const fs::path& program) {
  const auto clock = rig::base::make_system_clock();
  std::printf(
      "2048 x 2048, 8 bits, a software trigger a frame, every pixel checked; best of %d rounds in turns\n",
      kRounds);
  const auto own =
      compare(*clock, program, Picture::ramp, "Aravis' camera with its own ramp (ratio at least 0.9)");
  if (!own) return pass(own);
  const auto quick =
      compare(*clock, program, Picture::pattern, "the same camera, painting a quicker pattern (no bound)");
  if (!quick) return pass(quick);

  const auto camera =
      rig::sim::wire::GvCameraProcess::start(program, {"--lost", std::to_string(kLostPerThousand)});
  if (!camera) return pass(camera);
  constexpr int kRetention_ms = 30;
  const auto lossy = run_driver(*clock, Picture::pattern, kFramesWithLoss, kPatienceWithLoss, kRetention_ms);
  if (!lossy) return pass(lossy);
  std::printf(
      "with %d packets in a thousand lost: %d frames whole, %d refused or missing, %d wrong ones handed "
      "out\n",
      kLostPerThousand, lossy->good, lossy->lost, lossy->wrong);
  const bool nothing_lost = own->driver_lost == 0 && quick->driver_lost == 0;
  const bool nothing_wrong = own->wrong == 0 && quick->wrong == 0 && lossy->wrong == 0;
  return own->driver >= kLeastRatio * own->bare && nothing_lost && nothing_wrong && lossy->lost > 0 &&
         lossy->good > 0;
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
