#include "bench/aravis/bare_loop.h"

#include <arv.h>
#include <chrono>

#include "drivers/aravis_camera/frame_stream.h"

namespace rig::bench {

using Steady = std::chrono::steady_clock;

namespace {

constexpr int kBuffers = 4;
constexpr guint64 kPatience_us = 1'000'000;
constexpr double kFastest_hz = 1000;

base::Result<void> set_up(ArvCamera* camera, const LoopOptions& options) {
  GError* error = nullptr;
  arv_camera_set_pixel_format(camera, ARV_PIXEL_FORMAT_MONO_8, &error);
  if (error == nullptr) arv_camera_set_region(camera, 0, 0, options.width, options.height, &error);
  if (error == nullptr) arv_camera_set_exposure_time(camera, options.exposure_us, &error);
  if (error == nullptr && options.free_run) arv_camera_set_frame_rate(camera, kFastest_hz, &error);
  if (error == nullptr && !options.free_run) arv_camera_set_trigger(camera, "Software", &error);
  if (error == nullptr) arv_camera_gv_set_packet_size(camera, options.packet_size, &error);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  if (error == nullptr) return {};
  auto failed = base::fail(base::ErrorCode::device, error->message, options.address);
  g_error_free(error);
  return failed;
}

}  // namespace

base::Result<LoopResult> run_bare_loop(const LoopOptions& options,
                                       const std::function<bool(std::span<const std::uint8_t>)>& check) {
  ArvCamera* camera = arv_camera_new(options.address.c_str(), nullptr);
  if (camera == nullptr) return base::fail(base::ErrorCode::lost, "no camera there", options.address);
  LoopResult result;
  if (auto ready = set_up(camera, options); !ready) {
    g_object_unref(camera);
    return base::pass(ready);
  }
  ArvStream* stream = arv_camera_create_stream(camera, nullptr, nullptr, nullptr);
  // As the driver does, or the first frame is lost in both.
  (void)drivers::aravis::enlarge_socket(arv_gv_stream_get_port(ARV_GV_STREAM(stream)),
                                        options.socket_buffer_bytes);
  const guint payload = arv_camera_get_payload(camera, nullptr);
  for (int i = 0; i < kBuffers; ++i) arv_stream_push_buffer(stream, arv_buffer_new_allocate(payload));
  arv_camera_start_acquisition(camera, nullptr);
  Steady::time_point first{};
  for (int i = 0; i < options.frames; ++i) {
    if (!options.free_run) arv_camera_software_trigger(camera, nullptr);
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream, kPatience_us);
    if (i == 0) first = Steady::now();
    if (buffer == nullptr) {
      ++result.lost;
      continue;
    }
    std::size_t bytes = 0;
    const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(buffer, &bytes));
    if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) {
      ++result.lost;
    } else if (check({data, bytes})) {
      ++result.good;
    } else {
      ++result.wrong;
    }
    result.seconds = std::chrono::duration<double>(Steady::now() - first).count();
    arv_stream_push_buffer(stream, buffer);
  }
  arv_camera_stop_acquisition(camera, nullptr);
  g_object_unref(stream);
  g_object_unref(camera);
  return result;
}

}  // namespace rig::bench
