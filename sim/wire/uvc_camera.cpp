#include "sim/wire/uvc_camera.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "sim/wire/uvc_descriptors.h"
#include "sim/wire/uvc_negotiation.h"
#include "sim/wire/uvc_payload.h"

namespace rig::sim::wire {

namespace {

using namespace uvc_number_of;
using Steady = std::chrono::steady_clock;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::uint8_t kStandardToDevice = 0x00, kStandardToInterface = 0x01, kStandardToEndpoint = 0x02;
constexpr std::uint8_t kClassToInterface = 0x21, kClassFromInterface = 0xA1;
constexpr std::uint8_t kErrorCode = 0x02;    // VC_REQUEST_ERROR_CODE_CONTROL
constexpr std::uint8_t kStreamError = 0x06;  // VS_STREAM_ERROR_CODE_CONTROL

/// Whether a standard request ends the stream: for one with a bulk endpoint the class has no other means.
bool ends_stream(const SetupPacket& s) {
  constexpr std::uint8_t kClearFeature = 1, kSetConfiguration = 9, kSetInterface = 11;
  constexpr std::uint16_t kHalt = 0, kInwards = 0x80;
  if (s.request_type == kStandardToEndpoint && s.request == kClearFeature) {
    return s.value == kHalt && s.index == (kInwards | kVideoEndpoint);
  }
  if (s.request_type == kStandardToInterface && s.request == kSetInterface)
    return s.index == kStreamingInterface;
  return s.request_type == kStandardToDevice && s.request == kSetConfiguration;
}

/// Where the host asks what was wrong with its last request.
bool asks_for_error(const SetupPacket& s) {
  return s.index == kControlInterface && s.value == (kErrorCode << 8U);
}

/// A control that can only be read, of one byte.
UvcReply read_only(const SetupPacket& s, std::uint8_t value) {
  constexpr std::uint8_t kGet = 1;
  if (!s.is_in()) return UvcReply::refused(UvcError::invalid_request);
  if (s.request == uvc_request::kGetCur) return UvcReply::with({value});
  if (s.request == uvc_request::kGetInfo) return UvcReply::with({kGet});
  if (s.request == uvc_request::kGetLen) return UvcReply::with({1, 0});
  return UvcReply::refused(UvcError::invalid_request);
}

struct Faults {
  int settings_delay = 1;
  std::uint32_t light = kUvcDaylight;
  int damage = 0, drop = 0, cut = 0, cut_percent = 0;
  int stall = 0, ignore = 0;
  UvcError stall_with = UvcError::not_ready;
  milliseconds slow{0};
};

bool take_one(int& count) {
  if (count <= 0) return false;
  --count;
  return true;
}

microseconds in_microseconds(std::uint32_t count, std::uint32_t per) {
  return microseconds(std::uint64_t{count} * per / 10);
}

}  // namespace

struct UvcCamera::Impl {
  Impl(const std::string& serial, int delay) : standard(uvc_description(serial)) {
    faults.settings_delay = delay;
  }

  // Guards the wires, and is held while they are in use. Taken before `mutex` where both are.
  std::mutex wires_mutex;
  UvcWires wires;

  std::mutex mutex;  // guards all below
  std::condition_variable changed;
  StandardRequests standard;
  UvcControls controls;
  UvcNegotiation negotiation;
  Faults faults;
  UvcError last_error = UvcError::none;
  std::uint8_t stream_error = 0;
  bool ending = false;
  unsigned int stream = 0;  // another number whenever a stream begins or ends
  unsigned int power = 0;   // another number whenever the plug is pulled
  UvcState told;
  std::deque<UvcSettings> pipeline;  // in force when the last frames began, the newest at the back
  bool odd = false;
  const Steady::time_point born = Steady::now();
  std::thread thread;

  std::uint32_t ticks(Steady::time_point at) const {
    return static_cast<std::uint32_t>(std::chrono::duration_cast<microseconds>(at - born).count());
  }

  void send(std::uint8_t endpoint, std::vector<std::uint8_t> data) const {
    if (wires.send) wires.send(endpoint, std::move(data));
  }

  // With the mutex held. What waits to be fetched is for the caller to forget.
  void end_stream() {
    if (told.streaming) ++told.stops;
    told.streaming = false;
    ++stream;
    changed.notify_all();
  }

  void begin_stream() {
    told.choice = negotiation.committed();
    told.streaming = true;
    ++told.commits;
    ++stream;
    pipeline.clear();
    changed.notify_all();
  }

  UvcReply to_streaming(const SetupPacket& s, std::span<const std::uint8_t> out) {
    if (s.value == (kStreamError << 8U)) return read_only(s, stream_error);
    UvcReply reply = negotiation.answer(s, out);
    const bool commits = s.request == uvc_request::kSetCur &&
                         s.value == (UvcNegotiation::kCommitControl << 8U) && reply.error == UvcError::none;
    if (commits) begin_stream();
    return reply;
  }

  UvcReply to_control(const SetupPacket& s, std::span<const std::uint8_t> out) {
    if (asks_for_error(s)) return read_only(s, static_cast<std::uint8_t>(last_error));
    if ((s.index >> 8U) == 0) return UvcReply::refused(UvcError::invalid_control);
    const bool sets_exposure = s.request == uvc_request::kSetCur && s.value == 0x0400 &&
                               s.index == ((kCamera << 8U) | kControlInterface);
    UvcReply reply = controls.answer(s, out);
    if (sets_exposure && reply.error == UvcError::none) ++told.exposures_set;
    return reply;
  }

  ControlAnswer class_request(std::unique_lock<std::mutex>& lock, const SetupPacket& s,
                              std::span<const std::uint8_t> out) {
    using Kind = ControlAnswer::Kind;
    const auto interface = static_cast<std::uint8_t>(s.index & 0xFFU);
    if (faults.slow.count() > 0) {
      const unsigned int now = power;
      changed.wait_for(lock, faults.slow, [&] { return ending || power != now; });
    }
    const bool for_error = asks_for_error(s);
    if (!for_error && take_one(faults.ignore)) return {Kind::silence, {}};
    UvcReply reply;
    if (!for_error && take_one(faults.stall)) {
      reply = UvcReply::refused(faults.stall_with);
    } else if (interface == kControlInterface) {
      reply = to_control(s, out);
    } else {
      const bool streaming = interface == kStreamingInterface && (s.index >> 8U) == 0;
      reply = streaming ? to_streaming(s, out) : UvcReply::refused(UvcError::invalid_unit);
    }
    if (reply.error == UvcError::none) {
      if (!for_error) last_error = UvcError::none;
      return {Kind::done, std::move(reply.data)};
    }
    last_error = reply.error;
    ++told.stalled;
    return ControlAnswer::stalled();
  }

  // ---- the sensor -------------------------------------------------------------------------------------

  struct Frame {
    UvcPictureFacts facts;
    UvcStreamChoice choice;
    unsigned int stream = 0;
    Steady::time_point began, exposed, next;
    std::vector<std::uint8_t> status = {};
  };

  std::uint32_t automatic_exposure() const {
    constexpr std::uint64_t kTarget = 49152, kBrightestBand = 8;
    const UvcSettings now = controls.settings();
    const std::uint64_t per_unit = kBrightestBand * now.gain * faults.light;
    std::uint64_t wanted = per_unit == 0 ? kUvcMost.exposure_100us : kTarget * kUvcDaylight / per_unit;
    constexpr std::uint32_t kIntervalUnits = 1000;  // 100 us in 100 ns
    if (!controls.may_slow_down())
      wanted = std::min<std::uint64_t>(wanted, told.choice.interval / kIntervalUnits);
    return static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(wanted, kUvcLeast.exposure_100us, kUvcMost.exposure_100us));
  }

  // With the mutex held.
  Frame begin_frame(Steady::time_point now) {
    Frame frame;
    if (controls.automatic()) {
      if (auto packet = controls.expose_automatically(automatic_exposure()))
        frame.status = *std::move(packet);
    }
    pipeline.push_back(controls.settings());
    const auto back = static_cast<std::size_t>(faults.settings_delay);
    while (pipeline.size() > back + 1) pipeline.pop_front();
    frame.facts = {++told.frame, pipeline.front(), faults.light};
    frame.choice = told.choice;
    frame.stream = stream;
    constexpr std::uint32_t k100us = 1000, k100ns = 1;
    frame.began = now;
    frame.exposed = now + in_microseconds(frame.facts.settings.exposure_100us, k100us);
    frame.next = std::max(frame.exposed, now + in_microseconds(frame.choice.interval, k100ns));
    return frame;
  }

  void deliver(const Frame& frame) {
    std::vector<std::uint8_t> picture =
        paint_uvc_picture(frame.facts, frame.choice.pixels(), frame.choice.size());
    const std::lock_guard using_wires(wires_mutex);
    UvcFrameHead head;
    {
      const std::lock_guard lock(mutex);
      if (frame.stream != stream || take_one(faults.drop)) return;
      if (!wires.unfetched || wires.unfetched(kVideoEndpoint) > 0) {
        ++told.overrun;
        return;
      }
      ++told.sent;
      constexpr std::uint8_t kDiscontinuity = 3;
      head.damaged = take_one(faults.damage);
      if (head.damaged) stream_error = kDiscontinuity;
      if (take_one(faults.cut))
        picture.resize(picture.size() * static_cast<std::size_t>(faults.cut_percent) / 100);
      head.odd = odd = !odd;
    }
    head.taken = ticks(frame.began);
    head.sent = ticks(Steady::now());
    head.bus_frame = static_cast<std::uint16_t>((head.sent / 1000) & 0xFFFFU);
    for (auto& payload : uvc_payloads(picture, head, kUvcMostPayload))
      send(kVideoEndpoint, std::move(payload));
  }

  void run() {
    std::unique_lock lock(mutex);
    Steady::time_point next = Steady::now();
    while (!ending) {
      if (!told.streaming) {
        changed.wait(lock, [this] { return ending || told.streaming; });
        next = Steady::now();
        continue;
      }
      const Frame frame = begin_frame(std::max(next, Steady::now()));
      next = frame.next;
      const auto over = [&] { return ending || stream != frame.stream; };
      lock.unlock();
      if (!frame.status.empty()) {
        const std::lock_guard using_wires(wires_mutex);
        send(kStatusEndpoint, frame.status);
      }
      lock.lock();
      if (!changed.wait_until(lock, frame.exposed, over)) {
        lock.unlock();
        deliver(frame);
        lock.lock();
        changed.wait_until(lock, frame.next, over);
      }
      if (stream != frame.stream) next = Steady::now();
    }
  }
};

UvcCamera::UvcCamera(const std::string& serial, int settings_delay)
    : impl_(std::make_unique<Impl>(serial, settings_delay)) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

UvcCamera::~UvcCamera() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
    impl_->changed.notify_all();
  }
  impl_->thread.join();
}

ControlAnswer UvcCamera::control(const SetupPacket& setup, std::span<const std::uint8_t> out) {
  ControlAnswer answer;
  bool forget = false;
  {
    std::unique_lock lock(impl_->mutex);
    if (auto answered = impl_->standard.answer(setup)) {
      forget = ends_stream(setup) && answered->kind == ControlAnswer::Kind::done;
      if (forget) impl_->end_stream();
      answer = *std::move(answered);
    } else if (setup.request_type == kClassToInterface || setup.request_type == kClassFromInterface) {
      const unsigned int before = impl_->stream;
      answer = impl_->class_request(lock, setup, out);
      forget = impl_->stream != before;
    } else {
      return ControlAnswer::stalled();
    }
  }
  if (forget) {
    const std::lock_guard using_wires(impl_->wires_mutex);
    if (impl_->wires.forget) impl_->wires.forget(kVideoEndpoint);
  }
  return answer;
}

void UvcCamera::connect(UvcWires wires) {
  const std::lock_guard lock(impl_->wires_mutex);
  impl_->wires = std::move(wires);
}

void UvcCamera::disconnect() {
  const std::lock_guard using_wires(impl_->wires_mutex);
  impl_->wires = {};
  const std::lock_guard lock(impl_->mutex);
  impl_->end_stream();
  impl_->controls = {};
  impl_->negotiation = {};
  impl_->last_error = UvcError::none;
  impl_->stream_error = 0;
  impl_->odd = false;
  ++impl_->power;
  impl_->changed.notify_all();
}

void UvcCamera::set_light(std::uint32_t light) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.light = std::min(light, kUvcMostLight);
}
void UvcCamera::set_settings_delay(int frames) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.settings_delay = std::max(frames, 0);
}
void UvcCamera::damage_frames(int frames) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.damage = frames;
}
void UvcCamera::drop_frames(int frames) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.drop = frames;
}
void UvcCamera::cut_frames(int frames, int percent) {
  const std::lock_guard lock(impl_->mutex);
  constexpr int kAll = 100;
  impl_->faults.cut = frames;
  impl_->faults.cut_percent = std::clamp(percent, 0, kAll);
}
void UvcCamera::stall_requests(int requests, UvcError error) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.stall = requests;
  impl_->faults.stall_with = error;
}
void UvcCamera::ignore_requests(int requests) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.ignore = requests;
}
void UvcCamera::answer_slowly(milliseconds after) {
  const std::lock_guard lock(impl_->mutex);
  impl_->faults.slow = after;
}

UvcState UvcCamera::state() {
  const std::lock_guard lock(impl_->mutex);
  UvcState state = impl_->told;
  state.settings = impl_->controls.settings();
  state.automatic = impl_->controls.automatic();
  return state;
}

}  // namespace rig::sim::wire
