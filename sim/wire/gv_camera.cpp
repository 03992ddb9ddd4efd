#include "sim/wire/gv_camera.h"

#include <algorithm>
#include <array>
#include <arv.h>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <netinet/in.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "sim/wire/gv_genicam.h"
#include "sim/wire/gv_pattern.h"
#include "sim/wire/gvcp_resend.h"
#include "sim/wire/gvsp.h"
#include "sim/wire/gvsp_sender.h"
#include "sim/wire/pfnc.h"

namespace rig::sim::wire {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

constexpr std::uint32_t kSoftware = 1, kLine0 = 0;    // of TriggerSource
constexpr std::uint32_t kPacketSizeRegister = 0xd04;  // of GigE Vision, stream channel 0
constexpr std::uint32_t kAddressRegister = 0x24, kCapabilityRegister = 0x934;
constexpr std::uint32_t kCanResend = 1U << 2;
constexpr double kLongestExposure_s = 0.3;  // it hears nothing meanwhile, and Aravis asks again after 0.5

fs::path write_description(bool with_chunks) {
  ArvFakeCamera* plain = arv_fake_camera_new("plain");
  std::size_t size = 0;
  const char* xml = arv_fake_camera_get_genicam_xml(plain, &size);
  const std::string extended = extended_genicam(std::string(xml, size), with_chunks);
  g_object_unref(plain);
  std::string name = (fs::temp_directory_path() / "rig-gv-camera-XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  if (fd >= 0) ::close(fd);
  std::ofstream(name) << extended;
  return name;
}

}  // namespace

struct GvCamera::State {
  explicit State(const GvCameraOptions& wanted)
      : options(wanted), description(wanted.paints ? write_description(wanted.own_packets) : fs::path()) {}
  ~State() {
    std::error_code gone;
    if (!description.empty()) fs::remove(description, gone);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  const GvCameraOptions options;
  const fs::path description;
  ArvGvFakeCamera* camera = nullptr;
  std::atomic<int> lost{0};           // packets in a thousand
  std::atomic<double> next_loss{-1};  // share of the next frame's packets; below 0: as ever
  std::atomic<std::uint32_t> frames{0};
  std::mutex fill_mutex;
  std::vector<std::uint16_t> line;
  std::vector<std::uint8_t> payload;  // of a frame with packets of our own
  std::atomic<FrameFault> fault{FrameFault::none};
  std::atomic<int> delay_ms{0};
  std::thread late;  // sends a frame that is delayed
  std::uint16_t skipped = 0;
  GvspSender sender;
  std::unique_ptr<ResendEar> ear;
  std::thread clock;  // writes the camera's time into its memory
  std::atomic<bool> ending{false};

  ArvFakeCamera* fake() { return arv_gv_fake_camera_get_fake_camera(camera); }
  std::uint32_t reg(std::uint32_t address) {
    guint32 value = 0;
    arv_fake_camera_read_register(fake(), address, &value);
    return value;
  }
  void set(std::uint32_t address, std::uint32_t value) {
    arv_fake_camera_write_register(fake(), address, value);
  }

  bool start();
  bool listen_for_requests();
  void stop();
  [[nodiscard]] sockaddr_in stream_address();
  void send(ArvBuffer* buffer, std::uint32_t exposure_us, double loss);
  void fill(ArvBuffer* buffer, std::uint32_t exposure_us, std::uint32_t gain, std::uint32_t format);
};

// On the camera's own thread, before the first packet of the frame.
void GvCamera::State::fill(ArvBuffer* buffer, std::uint32_t exposure_us, std::uint32_t gain,
                           std::uint32_t format) {
  const std::lock_guard lock(fill_mutex);
  if (ending) return;
  const double share = next_loss.exchange(-1);
  const double loss = share >= 0 ? share : lost / 1000.0;
  g_object_set(camera, "gvsp-lost-ratio", options.own_packets ? 1.0 : loss, nullptr);
  if (options.exposes) {
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::min(exposure_us * 1e-6, kLongestExposure_s)));
  }
  const PatternFacts facts{exposure_us, frames++, gain};
  gint x = 0, y = 0, width = 0, height = 0;
  arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
  const int bits = pfnc_bits(format);
  if (bits == 0 || width % 4 != 0) return;
  std::size_t size = 0;
  auto* bytes = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const std::size_t line_bytes = static_cast<std::size_t>(width) * ((format >> 16) & 0xff) / 8;
  if (options.own_packets) {
    payload.resize(line_bytes * static_cast<std::size_t>(height));
    bytes = payload.data();
  }
  line.resize(static_cast<std::size_t>(width));
  for (std::size_t i = 0; i < static_cast<std::size_t>(height); ++i) {
    paint_pattern_line(facts, bits, i, line);
    pack_samples(format, line, bytes + i * line_bytes);
  }
  if (options.own_packets) send(buffer, exposure_us, loss);
}

void GvCamera::State::send(ArvBuffer* buffer, std::uint32_t exposure_us, double loss) {
  const FrameFault wrong = fault.exchange(FrameFault::none);
  GvspFrame frame;
  if (wrong == FrameFault::skipped_number) ++skipped;
  frame.id = static_cast<std::uint16_t>(arv_buffer_get_frame_id(buffer) + skipped);
  frame.timestamp_ns = static_cast<std::uint64_t>(g_get_real_time()) * 1000;
  frame.pixel_format = arv_buffer_get_image_pixel_format(buffer);
  if (wrong == FrameFault::other_format) frame.pixel_format ^= 1;
  gint x = 0, y = 0, width = 0, height = 0;
  arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
  frame.offset_x = static_cast<std::uint32_t>(x);
  frame.offset_y = static_cast<std::uint32_t>(y);
  frame.width = static_cast<std::uint32_t>(width);
  frame.height = static_cast<std::uint32_t>(height);
  frame.has_chunks = reg(kChunkModeRegister) != 0;
  if (frame.has_chunks) {
    end_chunk(payload, kImageChunk, payload.size());
    const double told_us = exposure_us * (wrong == FrameFault::other_exposure ? 2.0 : 1.0);
    append_chunk(payload, kExposureChunk, big_endian(std::bit_cast<std::uint64_t>(told_us), 8));
    append_chunk(payload, kTimestampChunk, big_endian(frame.timestamp_ns, 8));
  }
  frame.payload = payload;
  if (wrong == FrameFault::cut_short) frame.payload = frame.payload.first(payload.size() / 2);
  auto packets = gvsp_packets(frame, reg(kPacketSizeRegister) & 0xffff);
  const int times = wrong == FrameFault::packets_twice ? 2 : 1;
  const milliseconds delay(delay_ms.exchange(0));
  if (delay.count() == 0) return sender.send(stream_address(), frame.id, std::move(packets), times, loss);
  if (late.joinable()) late.join();
  late = std::thread([this, id = frame.id, packets = std::move(packets), times, loss, delay]() mutable {
    std::this_thread::sleep_for(delay);
    const std::lock_guard lock(fill_mutex);
    if (!ending) sender.send(stream_address(), id, std::move(packets), times, loss);
  });
}

sockaddr_in GvCamera::State::stream_address() {
  GSocketAddress* to = arv_fake_camera_get_stream_address(fake());
  sockaddr_in address{};
  g_socket_address_to_native(to, &address, sizeof address, nullptr);
  g_object_unref(to);
  return address;
}

bool GvCamera::State::listen_for_requests() {
  ear = ResendEar::listen({htonl(reg(kAddressRegister))}, [this](const ResendRequest& request) {
    sender.send_again(request, lost / 1000.0);
  });
  if (ear == nullptr) return false;
  set(kCapabilityRegister, reg(kCapabilityRegister) | kCanResend);
  return true;
}

bool GvCamera::State::start() {
  ending = false;
  camera = arv_gv_fake_camera_new_full(options.interface.c_str(), options.serial.c_str(),
                                       description.empty() ? nullptr : description.c_str());
  if (arv_gv_fake_camera_is_running(camera) == FALSE) {
    g_clear_object(&camera);
    return false;
  }
  if (options.resends && !listen_for_requests()) {
    g_clear_object(&camera);
    return false;
  }
  arv_fake_camera_set_trigger_frequency(fake(), options.trigger_hz);
  if (options.paints) {
    arv_fake_camera_set_fill_pattern(
        fake(),
        [](ArvBuffer* buffer, void* state, guint32 exposure_us, guint32 gain, ArvPixelFormat format) {
          static_cast<State*>(state)->fill(buffer, exposure_us, gain, format);
        },
        this);
  }
  set(kReadyRegister, 1);
  set(kTemperatureRegister, 3125);
  clock = std::thread([this] {
    while (!ending) {
      const auto now = static_cast<std::uint64_t>(g_get_real_time()) * 1000;
      std::array<std::uint8_t, 8> bytes{};
      for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(now >> (56 - 8 * i));
      arv_fake_camera_write_memory(fake(), kClockRegister, bytes.size(), bytes.data());
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  return true;
}

void GvCamera::State::stop() {
  if (camera == nullptr) return;
  {
    const std::lock_guard lock(fill_mutex);
    ending = true;
    g_object_set(camera, "gvsp-lost-ratio", 1.0, nullptr);  // of a frame that is due just now
  }
  ear.reset();
  clock.join();
  if (late.joinable()) late.join();
  g_object_unref(camera);
  camera = nullptr;
}

GvCamera::GvCamera(const GvCameraOptions& options) : state_(std::make_unique<State>(options)) {
  state_->start();
}

GvCamera::~GvCamera() {
  state_->stop();
}

bool GvCamera::is_running() const {
  return state_->camera != nullptr;
}

void GvCamera::vanish() {
  state_->stop();
}

bool GvCamera::come_back() {
  return is_running() || state_->start();
}

void GvCamera::lose(int per_thousand) {
  state_->lost = per_thousand;
}

void GvCamera::corrupt_next() {
  state_->next_loss = 0.5;
}

void GvCamera::spoil_next(FrameFault fault) {
  state_->fault = fault;
}

void GvCamera::delay_next(milliseconds by) {
  state_->delay_ms = static_cast<int>(by.count());
}

void GvCamera::drop_next() {
  state_->next_loss = 1;
}

bool GvCamera::pulse() {
  if (!is_running()) return false;
  State& s = *state_;
  const bool waits = s.reg(ARV_FAKE_CAMERA_REGISTER_ACQUISITION) == 1 &&
                     s.reg(ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE) == 1 &&
                     s.reg(ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE) == kLine0;
  if (!waits) return false;
  // Aravis' camera has no input: for one frame it hears its own command.
  const std::uint32_t before = s.frames;
  s.set(ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOFTWARE, 1);
  s.set(ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE, kSoftware);
  for (int i = 0; i < 1000 && s.frames == before; ++i) std::this_thread::sleep_for(milliseconds(1));
  s.set(ARV_FAKE_CAMERA_REGISTER_TRIGGER_SOURCE, kLine0);
  return s.frames != before;
}

void GvCamera::set_temperature_c(double celsius) {
  if (is_running())
    state_->set(kTemperatureRegister, static_cast<std::uint32_t>(static_cast<int>(celsius * 100)));
}

void GvCamera::set_ready(bool ready) {
  if (is_running()) state_->set(kReadyRegister, ready ? 1 : 0);
}

void GvCamera::drop_control() {
  if (is_running()) arv_fake_camera_set_control_channel_privilege(state_->fake(), 0);
}

std::uint32_t GvCamera::frames() const {
  return state_->frames;
}

}  // namespace rig::sim::wire
