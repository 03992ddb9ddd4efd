// A USB video camera in user space, with an exposure as real ones have it: a function of control transfers
// and of a bulk endpoint. Linux drives it with uvcvideo, through vhci.h. Written from the USB Device Class
// Definition for Video Devices, revision 1.1, and its payload for uncompressed video.
//
// It takes a frame every interval, or, if the exposure takes longer, when that is over. A frame is exposed
// with the settings that were in force so many beginnings of frames ago (the pipeline of the sensor), and it
// is sent when its exposure ends. While the stream stands still the settings reach the sensor at once. In the
// automatic mode it exposes its brightest band to three quarters of the full scale. It has memory for one
// frame: what the host has not fetched when the next is ready makes it lose that one. uvc_picture.h tells
// what a frame looks like.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "sim/wire/usb.h"
#include "sim/wire/uvc_controls.h"
#include "sim/wire/uvc_format.h"
#include "sim/wire/uvc_picture.h"

namespace rig::sim::wire {

/// The way to the host; endpoints without their direction bit.
struct UvcWires {
  std::function<void(std::uint8_t endpoint, std::vector<std::uint8_t> data)> send;
  std::function<std::size_t(std::uint8_t endpoint)> unfetched;
  std::function<void(std::uint8_t endpoint)> forget;
};

struct UvcState {
  bool streaming = false;
  UvcStreamChoice choice = {};  ///< of the stream, or of the last one
  UvcSettings settings = {};    ///< of the controls
  bool automatic = true;
  std::uint32_t frame = 0;  ///< the number of the last frame that was begun, from power-up
  int sent = 0;             ///< frames, those that are damaged or cut included
  int overrun = 0;          ///< frames that were lost because the host was too slow
  int commits = 0, stops = 0;
  int exposures_set = 0;  ///< by the host, and accepted
  int stalled = 0;        ///< class requests
};

/// Any thread may call anything.
class UvcCamera {
 public:
  explicit UvcCamera(const std::string& serial, int settings_delay = 1);
  ~UvcCamera();
  UvcCamera(const UvcCamera&) = delete;
  UvcCamera& operator=(const UvcCamera&) = delete;

  /// A control transfer, standard requests included.
  [[nodiscard]] ControlAnswer control(const SetupPacket& setup, std::span<const std::uint8_t> out);
  /// Where frames go from now on; without, they are lost.
  void connect(UvcWires wires);
  /// The plug is pulled, and with it the power: settings and stream are gone. When it returns the wires are
  /// not in use any more and no request waits.
  void disconnect();

  // What is done to it.
  void set_light(std::uint32_t light);       ///< see uvc_picture.h
  void set_settings_delay(int frames);       ///< 0: a setting is in the next frame that begins
  void damage_frames(int frames);            ///< the next so many have their error bit set
  void drop_frames(int frames);              ///< the next so many are taken and never sent
  void cut_frames(int frames, int percent);  ///< of the next so many only so much is sent
  /// The next so many class requests stall and leave this error; those for the error do not count.
  void stall_requests(int requests, UvcError error);
  void ignore_requests(int requests);                   ///< the next so many class requests find no answer
  void answer_slowly(std::chrono::milliseconds after);  ///< class requests, until said otherwise; 0: at once

  [[nodiscard]] UvcState state();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rig::sim::wire
