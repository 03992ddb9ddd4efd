// A camera on GigE Vision that nobody built: Aravis' own simulated one on a network interface, painting into
// its pixels how they were taken, with faults on command.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

namespace rig::sim::wire {

struct GvCameraOptions {
  std::string interface = "127.0.0.1";  ///< address or name; it answers on its UDP port 3956
  std::string serial = "RIG1";
  double trigger_hz = 1000;  ///< a triggered frame begins at the next beat of this
  bool exposes = false;      ///< a frame takes its exposure time, up to 0.3 s; else none
  bool paints = true;        ///< our pattern; else Aravis' own ramp, and none of what is added to it
  bool own_packets = false;  ///< it sends the packets itself, with chunks where they are switched on
  bool resends = false;      ///< those again that are asked for: with own packets, and CAP_NET_RAW
};

/// What is wrong with a frame, of a camera with packets of its own.
enum class FrameFault {
  none,
  skipped_number,  ///< its number leaves one out
  cut_short,       ///< half the payload, and the trailer says that this was all
  other_format,    ///< the leader tells another pixel format
  other_exposure,  ///< its chunk tells twice the exposure
  packets_twice,   ///< every packet comes twice
};

/// Beside what Aravis' camera has (2048 x 2048, Mono8 and 16, exposure, raw gain 0 to 10, software trigger):
/// the pixel formats of pfnc.h, DeviceTemperature, a latch of its clock, AcquisitionStatus, and a trigger
/// input, Line0. Any thread may call it; one call at a time.
class GvCamera {
 public:
  explicit GvCamera(const GvCameraOptions& options);
  ~GvCamera();
  GvCamera(const GvCamera&) = delete;
  GvCamera& operator=(const GvCamera&) = delete;

  /// False where its port is taken, there is no such interface, or it may not hear what it is asked for.
  [[nodiscard]] bool is_running() const;

  /// As when its cable is pulled: it answers nothing. come_back() makes it anew, as after power-up.
  void vanish();
  bool come_back();

  /// Of all packets of frames so many in a thousand never arrive.
  void lose(int per_thousand);
  /// Of the next frame half the packets, or all, never arrive.
  void corrupt_next();
  void drop_next();
  void spoil_next(FrameFault fault);
  /// Of a camera with packets of its own: those of the next frame leave so much after it was exposed, to
  /// where frames go by then.
  void delay_next(std::chrono::milliseconds by);
  /// A pulse on Line0. False: the camera did not wait for one.
  bool pulse();
  void set_temperature_c(double celsius);
  /// Whether it waits for a trigger, as AcquisitionStatus says.
  void set_ready(bool ready);
  /// Lets go of whoever controls it.
  void drop_control();
  /// Frames that it began to send since it was made.
  [[nodiscard]] std::uint32_t frames() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rig::sim::wire
