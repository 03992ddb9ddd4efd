// The sensor of a simulated video device: its controls as the kernel keeps them, and what of them a frame
// shows. A control that is set is taken over when a frame begins and shows some frames later.
#pragma once

#include <cstdint>
#include <deque>
#include <linux/videodev2.h>
#include <string>
#include <vector>

#include "sim/wire/video_pattern.h"

namespace rig::sim::wire {

/// How this camera tells its exposure.
enum class ExposureKind {
  absolute,  ///< V4L2_CID_EXPOSURE_ABSOLUTE, in 100 us, as UVC cameras
  lines,     ///< V4L2_CID_EXPOSURE, in lines of 20 us, as sensors
  none,      ///< no control: always 5 ms
};

class V4l2Sensor {
 public:
  V4l2Sensor(ExposureKind exposure, int delay_frames, int gain_min);

  /// Each answers 0 or the errno that the kernel would set.
  [[nodiscard]] int query_control(v4l2_queryctrl& about) const;
  [[nodiscard]] int query_menu(v4l2_querymenu& about) const;
  [[nodiscard]] int get_control(v4l2_control& value) const;
  [[nodiscard]] int set_control(const v4l2_control& value);

  /// A frame begins: what it will show.
  [[nodiscard]] VideoFacts begin_frame(std::uint32_t number);
  void set_light(std::uint8_t light) { light_ = light; }
  /// As after power-up: everything automatic.
  void power_cycle();
  /// The value of a control by its name as the device says it.
  [[nodiscard]] std::int32_t value_of(const std::string& name) const;

 private:
  struct Control {
    std::uint32_t id = 0;
    std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
    std::string name;
    std::int32_t min = 0, max = 0, step = 1, usual = 0, value = 0;
    std::uint32_t flags = 0;
    std::vector<std::string> menu;  // "" is an item that the device has not
  };
  struct Setting {
    std::uint32_t exposure_us = 0;
    std::uint8_t gain = 0;
  };

  [[nodiscard]] const Control* find(std::uint32_t id) const;
  [[nodiscard]] bool is_manual() const;
  [[nodiscard]] Setting setting() const;

  const ExposureKind exposure_;
  const int delay_frames_;
  std::vector<Control> controls_;  // by rising id
  std::deque<Setting> pipeline_;   // what frames that are to come will show
  std::uint8_t light_ = 100;
  std::uint32_t drift_ = 0;  // of what is automatic
};

}  // namespace rig::sim::wire
