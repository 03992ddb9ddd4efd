#include "sim/wire/v4l2_camera.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <system_error>
#include <thread>
#include <unistd.h>

#include "sim/wire/v4l2_queue.h"

namespace rig::sim::wire {

namespace fs = std::filesystem;

namespace {

using Steady = std::chrono::steady_clock;
using Packet = std::array<std::uint8_t, 4096>;

constexpr int kTurn_ms = 5;
constexpr std::uint32_t kMicro = 1'000'000;

Steady::duration duration(double s) {
  return std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(s));
}

std::int64_t nanoseconds(Steady::time_point at) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(at.time_since_epoch()).count();
}

std::vector<V4l2Queue::Size> sizes_of(const V4l2CameraOptions& options) {
  std::vector<V4l2Queue::Size> sizes;
  sizes.reserve(options.sizes.size());
  for (const auto& [width, height] : options.sizes) sizes.push_back({width, height});
  return sizes;
}

// Into a field that is all zeros.
void write_text(unsigned char* to, std::size_t room, const std::string& text) {
  std::copy_n(text.begin(), std::min(text.size(), room - 1), to);
}

}  // namespace

struct V4l2Camera::Device {
  struct User {
    int fd = -1;
    int plugged = 0;  // which plugging-in it opened
    std::uint32_t priority = V4L2_PRIORITY_DEFAULT;
  };
  struct Window {
    Trouble how = Trouble::flagged;
    Steady::time_point until;
  };

  Device(fs::path at, V4l2CameraOptions what)
      : socket(std::move(at)),
        options(std::move(what)),
        sensor(options.exposure, options.delay_frames, options.gain_min),
        queue(std::make_unique<V4l2Queue>(sizes_of(options), options.padding)),
        interval_us(static_cast<std::uint32_t>(options.interval_s * kMicro)) {}

  const fs::path socket;
  V4l2CameraOptions options;
  std::mutex mutex;
  std::condition_variable changed;
  V4l2Sensor sensor;
  std::unique_ptr<V4l2Queue> queue;
  std::uint32_t interval_us;
  int listener = -1;
  std::vector<User> users;
  int plugged = 1;
  int owner = -1;      // the user that has the buffers
  int streamings = 0;  // how often a stream was started
  bool stalled = false;
  std::uint32_t begun = 0;
  int dropped = 0;
  std::optional<std::pair<Trouble, int>> next_trouble;
  std::optional<std::pair<Trouble, std::chrono::milliseconds>> trouble_to_come;
  std::optional<Window> window;
  std::map<std::uint32_t, std::pair<int, int>> failing;  // request: errno, times
  std::atomic<bool> ended{false};
  std::thread server, frames;

  void listen();
  void deafen();
  void serve();
  void leave(const User& user);
  void end_stream();
  [[nodiscard]] std::size_t answer(User& user, Packet& packet, std::size_t size, int& pass);
  [[nodiscard]] int perform(User& user, std::uint32_t code, void* argument);
  [[nodiscard]] std::uint32_t highest_priority() const;
  [[nodiscard]] int of_buffers(const User& user, std::uint32_t code, void* argument);
  [[nodiscard]] int set_control(const v4l2_control& value);
  [[nodiscard]] int interval(v4l2_streamparm& parm, bool set);
  void describe(v4l2_capability& said) const;
  void run();
  void expose(std::unique_lock<std::mutex>& lock, int streaming);
  void hand_out(const VideoFacts& facts, Steady::time_point began);
  [[nodiscard]] std::optional<Trouble> trouble();
};

void V4l2Camera::Device::listen() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.native().size() >= sizeof(address.sun_path)) {
    throw std::system_error(ENAMETOOLONG, std::generic_category(), socket.string());
  }
  socket.native().copy(address.sun_path, socket.native().size());
  listener = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  std::error_code not_there;
  fs::remove(socket, not_there);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(listener, 4) != 0) {
    throw std::system_error(errno, std::generic_category(), socket.string());
  }
}

void V4l2Camera::Device::deafen() {
  if (listener >= 0) ::close(listener);
  listener = -1;
  std::error_code already_gone;
  fs::remove(socket, already_gone);
}

void V4l2Camera::Device::end_stream() {
  (void)queue->stop(V4L2_BUF_TYPE_VIDEO_CAPTURE);
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  (void)queue->make_buffers(none);
  owner = -1;
  ++streamings;
  changed.notify_all();
}

void V4l2Camera::Device::leave(const User& user) {
  const int fd = user.fd;
  if (owner == fd) end_stream();
  ::close(fd);
  std::erase_if(users, [&](const User& u) { return u.fd == fd; });
}

void V4l2Camera::Device::describe(v4l2_capability& said) const {
  said = {};
  write_text(said.driver, sizeof said.driver, "rig-sim");
  write_text(said.card, sizeof said.card, options.card);
  write_text(said.bus_info, sizeof said.bus_info, "platform:rig-sim");
  said.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_EXT_PIX_FORMAT;
  said.capabilities = said.device_caps | V4L2_CAP_DEVICE_CAPS;
}

int V4l2Camera::Device::interval(v4l2_streamparm& parm, bool set) {
  if (parm.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
  if (!options.tells_interval) return ENOTTY;
  v4l2_fract& told = parm.parm.capture.timeperframe;
  if (set) {
    if (queue->is_streaming()) return EBUSY;
    const std::uint64_t asked =
        told.denominator == 0 ? 0 : std::uint64_t{told.numerator} * kMicro / told.denominator;
    const auto least = static_cast<std::uint64_t>(options.interval_s * kMicro);
    interval_us = static_cast<std::uint32_t>(std::clamp(asked, least, std::uint64_t{kMicro}));
  }
  parm.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  told = {interval_us, kMicro};
  return 0;
}

int V4l2Camera::Device::set_control(const v4l2_control& value) {
  const int error = sensor.set_control(value);
  if (error == 0 && trouble_to_come) {
    window = Window{trouble_to_come->first, Steady::now() + trouble_to_come->second};
    trouble_to_come.reset();
  }
  return error;
}

int V4l2Camera::Device::of_buffers(const User& user, std::uint32_t code, void* argument) {
  const auto as = [&]<typename T>(T*) -> T& { return *static_cast<T*>(argument); };
  auto& buffer = as(static_cast<v4l2_buffer*>(nullptr));
  if (code == VIDIOC_QUERYBUF) return queue->describe(buffer);
  if (owner >= 0 && owner != user.fd) return EBUSY;
  switch (code) {
    case VIDIOC_REQBUFS: {
      auto& request = as(static_cast<v4l2_requestbuffers*>(nullptr));
      const int error = queue->make_buffers(request);
      if (error == 0) owner = request.count > 0 ? user.fd : -1;
      return error;
    }
    case VIDIOC_QBUF:
      return queue->queue(buffer);
    case VIDIOC_DQBUF:
      return queue->dequeue(buffer);
    case VIDIOC_STREAMON: {
      const int error = queue->start(static_cast<std::uint32_t>(as(static_cast<int*>(nullptr))));
      if (error == 0) {
        ++streamings;
        stalled = false;
        changed.notify_all();
      }
      return error;
    }
    default: {
      const int error = queue->stop(static_cast<std::uint32_t>(as(static_cast<int*>(nullptr))));
      ++streamings;
      changed.notify_all();
      return error;
    }
  }
}

std::uint32_t V4l2Camera::Device::highest_priority() const {
  std::uint32_t highest = V4L2_PRIORITY_UNSET;
  for (const User& user : users) highest = std::max(highest, user.priority);
  return highest;
}

int V4l2Camera::Device::perform(User& user, std::uint32_t code, void* argument) {
  const auto failure = failing.find(code);
  if (failure != failing.end() && failure->second.second > 0) {
    --failure->second.second;
    return failure->second.first;
  }
  const bool changes = code == VIDIOC_S_CTRL || code == VIDIOC_S_FMT || code == VIDIOC_S_PARM ||
                       code == VIDIOC_S_PRIORITY || code == VIDIOC_REQBUFS || code == VIDIOC_STREAMON ||
                       code == VIDIOC_STREAMOFF;
  if (changes && highest_priority() > user.priority) return EBUSY;
  switch (code) {
    case VIDIOC_QUERYCAP:
      describe(*static_cast<v4l2_capability*>(argument));
      return 0;
    case VIDIOC_ENUM_FMT:
      return V4l2Queue::list_format(*static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_G_FMT:
      return queue->get_format(*static_cast<v4l2_format*>(argument));
    case VIDIOC_S_FMT:
      return queue->set_format(*static_cast<v4l2_format*>(argument));
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      return interval(*static_cast<v4l2_streamparm*>(argument), code == VIDIOC_S_PARM);
    case VIDIOC_QUERYCTRL:
      return sensor.query_control(*static_cast<v4l2_queryctrl*>(argument));
    case VIDIOC_QUERYMENU:
      return sensor.query_menu(*static_cast<v4l2_querymenu*>(argument));
    case VIDIOC_G_CTRL:
      return sensor.get_control(*static_cast<v4l2_control*>(argument));
    case VIDIOC_S_CTRL:
      return set_control(*static_cast<v4l2_control*>(argument));
    case VIDIOC_G_PRIORITY:
      *static_cast<std::uint32_t*>(argument) = highest_priority();
      return 0;
    case VIDIOC_S_PRIORITY:
      user.priority = *static_cast<std::uint32_t*>(argument);
      return 0;
    case VIDIOC_REQBUFS:
    case VIDIOC_QUERYBUF:
    case VIDIOC_QBUF:
    case VIDIOC_DQBUF:
    case VIDIOC_STREAMON:
    case VIDIOC_STREAMOFF:
      return of_buffers(user, code, argument);
    default:
      return ENOTTY;
  }
}

// Into the packet; how many bytes. `pass`: a descriptor that goes with it.
std::size_t V4l2Camera::Device::answer(User& user, Packet& packet, std::size_t size, int& pass) {
  std::uint32_t code = 0;
  std::int32_t error = EINVAL;
  std::size_t argument = 0;
  alignas(8) Packet room = packet;
  if (size >= sizeof code) std::memcpy(&code, packet.data(), sizeof code);
  if (user.plugged != plugged) {
    error = ENODEV;
    argument = code == 0 ? 0 : _IOC_SIZE(code);
  } else if (code == 0) {
    std::array<std::uint32_t, 3> words{};
    if (size == sizeof words) {
      std::memcpy(words.data(), packet.data(), sizeof words);
      pass = queue->memory_at(words[1]);
      error = pass >= 0 && words[2] <= queue->image().sizeimage ? 0 : EINVAL;
    }
    if (error != 0) pass = -1;
  } else if (size == sizeof code + _IOC_SIZE(code)) {
    argument = _IOC_SIZE(code);
    std::memcpy(room.data(), packet.data() + sizeof code, argument);
    error = perform(user, code, room.data());
    std::memcpy(packet.data() + sizeof error, room.data(), argument);
  }
  std::memcpy(packet.data(), &error, sizeof error);
  return sizeof error + argument;
}

void V4l2Camera::Device::serve() {
  while (!ended) {
    std::vector<pollfd> waits;
    {
      const std::lock_guard lock(mutex);
      if (listener >= 0) waits.push_back({listener, POLLIN, 0});
      for (const User& user : users) waits.push_back({user.fd, POLLIN, 0});
    }
    (void)::poll(waits.data(), waits.size(), kTurn_ms);
    const std::lock_guard lock(mutex);
    if (listener >= 0) {
      const int fd = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (fd >= 0) users.push_back({fd, plugged, V4L2_PRIORITY_DEFAULT});
    }
    for (std::size_t i = 0; i < users.size();) {
      Packet packet{};
      const ssize_t n = ::recv(users[i].fd, packet.data(), packet.size(), 0);
      if (n < 0 && errno == EAGAIN) {
        ++i;
        continue;
      }
      if (n <= 0) {
        leave(users[i]);
        continue;
      }
      int pass = -1;
      iovec bytes{packet.data(), answer(users[i], packet, static_cast<std::size_t>(n), pass)};
      alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> room{};
      msghdr message{};
      message.msg_iov = &bytes;
      message.msg_iovlen = 1;
      if (pass >= 0) {
        message.msg_control = room.data();
        message.msg_controllen = room.size();
        cmsghdr* head = CMSG_FIRSTHDR(&message);
        head->cmsg_level = SOL_SOCKET;
        head->cmsg_type = SCM_RIGHTS;
        head->cmsg_len = CMSG_LEN(sizeof(int));
        std::memcpy(CMSG_DATA(head), &pass, sizeof pass);
      }
      (void)::sendmsg(users[i].fd, &message, MSG_NOSIGNAL);
      ++i;
    }
  }
}

std::optional<V4l2Camera::Trouble> V4l2Camera::Device::trouble() {
  if (next_trouble) {
    const Trouble how = next_trouble->first;
    if (--next_trouble->second == 0) next_trouble.reset();
    return how;
  }
  if (window && Steady::now() < window->until) return window->how;
  return std::nullopt;
}

void V4l2Camera::Device::hand_out(const VideoFacts& facts, Steady::time_point began) {
  std::uint8_t* memory = queue->next_memory();
  const bool exists = memory != nullptr && queue->format().packing != VideoPacking::none;
  const auto how = exists ? trouble() : std::nullopt;
  if (!exists || how == Trouble::dropped) {
    ++dropped;
    return;
  }
  const v4l2_pix_format& image = queue->image();
  std::vector<std::uint16_t> samples(image.width);
  const bool half = how == Trouble::flagged || how == Trouble::cut_off;
  // What fills up the lines is not zero, and what did not come is of an older frame.
  if (!half) std::memset(memory, 0xEE, image.sizeimage);
  for (std::uint32_t line = 0; line < (half ? image.height / 2 : image.height); ++line) {
    paint_video_line(facts, queue->format().bits, line, samples);
    pack_video_line(queue->format(), samples,
                    {memory + std::size_t{line} * image.bytesperline, image.bytesperline});
  }
  V4l2Queue::Frame frame;
  frame.sequence = facts.frame;
  frame.bytes = half ? image.sizeimage / 2 : image.sizeimage;
  frame.stamp_ns = nanoseconds(options.start_stamps ? began : Steady::now());
  frame.flags = options.start_stamps ? V4L2_BUF_FLAG_TSTAMP_SRC_SOE : V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  if (how != Trouble::unknown_clock) frame.flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (how == Trouble::flagged) frame.flags |= V4L2_BUF_FLAG_ERROR;
  queue->fill(frame);
}

// One frame, from its beginning until it may be the next one's turn.
void V4l2Camera::Device::expose(std::unique_lock<std::mutex>& lock, int streaming) {
  const auto over = [&] { return ended || streamings != streaming; };
  const auto began = Steady::now();
  VideoFacts facts = sensor.begin_frame(begun++);
  if (options.clips_exposure) facts.exposure_us = std::min(facts.exposure_us, interval_us);
  const double taken_s = facts.exposure_us * 1e-6 + options.readout_s;
  if (changed.wait_until(lock, began + duration(taken_s), over)) return;
  if (stalled) {
    changed.wait(lock, [&] { return over() || !stalled; });
    return;
  }
  hand_out(facts, began);
  const double clipped_s = options.clips_exposure ? 0 : taken_s;
  (void)changed.wait_until(lock, began + duration(std::max(clipped_s, interval_us * 1e-6)), over);
}

void V4l2Camera::Device::run() {
  std::unique_lock lock(mutex);
  int streaming = streamings;
  while (!ended) {
    if (streaming != streamings) begun = 0;
    streaming = streamings;
    if (queue->is_streaming()) {
      expose(lock, streaming);
    } else {
      changed.wait(lock, [&] { return ended || queue->is_streaming(); });
    }
  }
}

V4l2Camera::V4l2Camera(fs::path socket, V4l2CameraOptions options)
    : device_(std::make_unique<Device>(std::move(socket), std::move(options))) {
  device_->listen();
  device_->server = std::thread([device = device_.get()] { device->serve(); });
  device_->frames = std::thread([device = device_.get()] { device->run(); });
}

V4l2Camera::~V4l2Camera() {
  {
    const std::lock_guard lock(device_->mutex);
    device_->ended = true;
  }
  device_->changed.notify_all();
  device_->server.join();
  device_->frames.join();
  while (!device_->users.empty()) device_->leave(device_->users.front());
  device_->deafen();
}

void V4l2Camera::spoil_next(Trouble how, int frames) {
  const std::lock_guard lock(device_->mutex);
  device_->next_trouble = {how, frames};
}

void V4l2Camera::spoil_from_next_setting(Trouble how, std::chrono::milliseconds how_long) {
  const std::lock_guard lock(device_->mutex);
  device_->trouble_to_come = {how, how_long};
}

void V4l2Camera::stall() {
  const std::lock_guard lock(device_->mutex);
  device_->stalled = true;
}

void V4l2Camera::fail_next(unsigned long request, int error, int times) {
  const std::lock_guard lock(device_->mutex);
  device_->failing[static_cast<std::uint32_t>(request)] = {error, times};
}

void V4l2Camera::unplug() {
  const std::lock_guard lock(device_->mutex);
  if (device_->listener < 0) return;
  ++device_->plugged;
  device_->end_stream();
  device_->deafen();
}

void V4l2Camera::plug(const std::string& card) {
  const std::lock_guard lock(device_->mutex);
  if (!card.empty()) device_->options.card = card;
  device_->next_trouble.reset();
  device_->trouble_to_come.reset();
  device_->window.reset();
  device_->failing.clear();
  if (device_->listener >= 0) return;
  device_->sensor.power_cycle();
  device_->queue = std::make_unique<V4l2Queue>(sizes_of(device_->options), device_->options.padding);
  device_->listen();
}

void V4l2Camera::set_light(std::uint8_t light) {
  const std::lock_guard lock(device_->mutex);
  device_->sensor.set_light(light);
}

std::int32_t V4l2Camera::control(const std::string& name) {
  const std::lock_guard lock(device_->mutex);
  return device_->sensor.value_of(name);
}

std::uint32_t V4l2Camera::frames() {
  const std::lock_guard lock(device_->mutex);
  return device_->begun;
}

int V4l2Camera::dropped() {
  const std::lock_guard lock(device_->mutex);
  return device_->dropped;
}

}  // namespace rig::sim::wire
