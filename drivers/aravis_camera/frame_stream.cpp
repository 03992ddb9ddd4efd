#include "drivers/aravis_camera/frame_stream.h"

#include <cstdlib>
#include <filesystem>
#include <netinet/in.h>
#include <sys/socket.h>

namespace rig::drivers::aravis {

namespace fs = std::filesystem;

namespace {

bool is_udp_on(int fd, unsigned port) {
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return false;
  sockaddr_in address{};
  size = sizeof address;
  if (::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return false;
  return address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

}  // namespace

int enlarge_socket(unsigned port, int bytes) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd", error)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    if (!is_udp_on(fd, port)) continue;
    if (::setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0) {
      (void)::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    }
    int granted = 0;
    socklen_t size = sizeof granted;
    if (::getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &granted, &size) != 0) return 0;
    return granted / 2;  // the kernel counts its own bookkeeping as much again
  }
  return 0;
}

FrameStream::FrameStream(ArvCamera* camera, const Settings& settings, std::size_t payload_bytes)
    : camera_(camera), settings_(settings) {
  for (int i = 0; i < settings.buffers; ++i) buffers_.emplace_back(arv_buffer_new_allocate(payload_bytes));
}

base::Result<void> FrameStream::open() {
  Failed failed;
  stream_.reset(arv_camera_create_stream(camera_, nullptr, nullptr, failed.slot()));
  if (!stream_ || failed) return tl::unexpected<base::Error>(failed.as_error("to open its stream"));
  if (ARV_IS_GV_STREAM(stream_.get())) {
    // Aravis itself enlarges the socket only once the first frame is on its way, and loses its packets.
    const unsigned port = arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get()));
    socket_buffer_ = enlarge_socket(port, settings_.socket_buffer_bytes);
    g_object_set(stream_.get(), "packet-timeout", static_cast<guint>(settings_.packet_timeout.count()),
                 "frame-retention", static_cast<guint>(settings_.frame_retention.count()), nullptr);
    if (!settings_.packet_resend) {
      g_object_set(stream_.get(), "packet-resend", ARV_GV_STREAM_PACKET_RESEND_NEVER, nullptr);
    }
  }
  for (const auto& buffer : buffers_) give_back(buffer.get());
  return {};
}

std::uint64_t FrameStream::resent_packets() const {
  guint64 resent = 0;
  if (stream_ && ARV_IS_GV_STREAM(stream_.get())) {
    arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &resent, nullptr);
  }
  return resent_before_ + resent;
}

void FrameStream::close() {
  resent_before_ = resent_packets();
  stream_.reset();
  socket_buffer_ = 0;
}

ArvBuffer* FrameStream::pop() {
  // The stream hands over a reference; ours keeps the buffer.
  ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_.get());
  if (buffer != nullptr) g_object_unref(buffer);
  return buffer;
}

void FrameStream::give_back(ArvBuffer* buffer) {
  arv_stream_push_buffer(stream_.get(), ARV_BUFFER(g_object_ref(buffer)));
}

}  // namespace rig::drivers::aravis
