// A video device behind a socket, in the place of a node of the kernel (its protocol is in
// docs/drivers/v4l2_camera.md): a sensor that runs free, and of the kernel what a program meets of it, with
// its errors. Frames are painted with how they were taken (video_pattern.h).
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/wire/v4l2_sensor.h"

namespace rig::sim::wire {

struct V4l2CameraOptions {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes{{64, 48}};  ///< width and height, pixels
  std::uint32_t padding = 0;                                             ///< bytes after each line
  double interval_s = 0.004;  ///< between frames that are exposed shortly
  double readout_s = 0.001;
  int delay_frames = 2;         ///< until a control shows
  bool start_stamps = false;    ///< stamps are of the start of the exposure, else of the end of the frame
  bool tells_interval = true;   ///< VIDIOC_G_PARM
  bool clips_exposure = false;  ///< it never exposes longer than the interval, and does not say so
  ExposureKind exposure = ExposureKind::absolute;
  int gain_min = 0;
  std::string card = "rig-sim-v4l2";
};

class V4l2Camera {
 public:
  explicit V4l2Camera(std::filesystem::path socket, V4l2CameraOptions options = {});
  ~V4l2Camera();
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  enum class Trouble {
    flagged,  ///< half of the frame comes, and is flagged as damaged
    cut_off,  ///< half of it comes, and nothing says so
    dropped,  ///< it never comes, and its number is left out
    unknown_clock,
  };
  /// The next so many frames that would be handed out.
  void spoil_next(Trouble how, int frames);
  /// All frames for so long, from the next time that a control is set.
  void spoil_from_next_setting(Trouble how, std::chrono::milliseconds how_long);
  /// The sensor stops sending, until it is streamed anew.
  void stall();
  /// The next so many requests with this number are answered with this errno.
  void fail_next(unsigned long request, int error, int times = 1);

  /// Its plug is pulled: every request is answered ENODEV, and nobody can open it.
  void unplug();
  /// As after power-up, with another card name if one is given.
  void plug(const std::string& card = {});
  void set_light(std::uint8_t light);

  [[nodiscard]] std::int32_t control(const std::string& name);
  /// Frames that the sensor has begun since it streams.
  [[nodiscard]] std::uint32_t frames();
  /// Frames that found no buffer or were dropped, since the beginning.
  [[nodiscard]] int dropped();

 private:
  struct Device;
  std::unique_ptr<Device> device_;
};

}  // namespace rig::sim::wire
