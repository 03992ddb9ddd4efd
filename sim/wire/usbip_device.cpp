#include "sim/wire/usbip_device.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <deque>
#include <mutex>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include "sim/wire/usbip_frames.h"

namespace rig::sim::wire {

namespace {

// No host asks for more at once; a longer message is a broken one.
constexpr std::uint32_t kMostBytes = 16U << 20U;
constexpr std::uint32_t kIsoDescriptor = 16;

struct Waiting {
  std::uint32_t number;
  std::uint32_t length;
  std::uint8_t endpoint;
};

struct Queued {
  std::uint8_t endpoint;
  std::vector<std::uint8_t> data;
};

}  // namespace

struct UsbIpDevice::Impl {
  Impl(int s, ControlHandler c, OutHandler o) : socket(s), control(std::move(c)), out(std::move(o)) {}

  const int socket;
  const ControlHandler control;
  const OutHandler out;
  std::atomic<bool> ended{false};
  std::mutex mutex;             // guards what is written to the socket and all below
  std::deque<Waiting> waiting;  // transfers that the host waits for, of all endpoints
  std::deque<Queued> queued;
  std::uint32_t newest = 0;                // number of the last transfer that came
  std::vector<UsbIpUnlink> ahead_of_time;  // of transfers that have not come yet
  std::thread thread;

  bool read(std::span<std::uint8_t> bytes) const {
    while (!bytes.empty()) {
      const ssize_t n = ::recv(socket, bytes.data(), bytes.size(), 0);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return true;
  }

  void write(std::span<const std::uint8_t> bytes) const {
    while (!bytes.empty()) {
      const ssize_t n = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return;
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
  }

  void answer(std::uint32_t number, std::int32_t status, std::uint32_t length,
              std::span<const std::uint8_t> data = {}) {
    const auto header = usbip_ret_submit(number, status, length);
    write(header);
    write(data);
  }

  // With the lock held: gives queued data to the transfers that wait for them.
  void match() {
    for (auto w = waiting.begin(); w != waiting.end();) {
      const auto q = std::find_if(queued.begin(), queued.end(), [&](const Queued& each) {
        return w->endpoint != 0 && each.endpoint == w->endpoint;
      });
      if (q == queued.end()) {
        ++w;
        continue;
      }
      const std::size_t n = std::min<std::size_t>(w->length, q->data.size());
      answer(w->number, usbip_status::kDone, static_cast<std::uint32_t>(n), std::span(q->data).first(n));
      q->data.erase(q->data.begin(), q->data.begin() + static_cast<std::ptrdiff_t>(n));
      if (q->data.empty()) queued.erase(q);
      w = waiting.erase(w);
    }
  }

  void control_transfer(const UsbIpSubmit& submit, std::span<const std::uint8_t> data) {
    const SetupPacket setup = parse_setup(submit.setup);
    ControlAnswer got = control(setup, data);
    const std::lock_guard lock(mutex);
    switch (got.kind) {
      case ControlAnswer::Kind::stall:
        return answer(submit.number, usbip_status::kStall, 0);
      case ControlAnswer::Kind::silence:
        waiting.push_back({submit.number, submit.length, 0});
        return;
      case ControlAnswer::Kind::done:
        break;
    }
    if (!submit.in)
      return answer(submit.number, usbip_status::kDone, static_cast<std::uint32_t>(data.size()));
    const std::size_t most = std::min<std::size_t>(setup.length, submit.length);
    if (got.data.size() > most) got.data.resize(most);
    answer(submit.number, usbip_status::kDone, static_cast<std::uint32_t>(got.data.size()), got.data);
  }

  void submit(const UsbIpSubmit& s, std::span<const std::uint8_t> data) {
    if (s.endpoint == 0) return control_transfer(s, data);
    if (s.iso_packets != 0) {
      const std::lock_guard lock(mutex);
      return answer(s.number, usbip_status::kProtocol, 0);
    }
    const auto endpoint = static_cast<std::uint8_t>(s.endpoint & 0x0FU);
    if (s.in) {
      const std::lock_guard lock(mutex);
      waiting.push_back({s.number, s.length, endpoint});
      return match();
    }
    const bool taken = out && out(endpoint, data);
    const std::lock_guard lock(mutex);
    answer(s.number, taken ? usbip_status::kDone : usbip_status::kStall, taken ? s.length : 0);
  }

  void unlink(const UsbIpUnlink& u) {
    const std::lock_guard lock(mutex);
    const auto found =
        std::find_if(waiting.begin(), waiting.end(), [&](const Waiting& w) { return w.number == u.of; });
    const bool pending = found != waiting.end();
    // The kernel sends from two queues, of which this one may overtake the other. Were it told that the
    // transfer is done, it would take that for lost and hang up when its answer comes.
    if (!pending && static_cast<std::int32_t>(u.of - newest) > 0) {
      ahead_of_time.push_back(u);
      return;
    }
    if (pending) waiting.erase(found);
    write(usbip_ret_unlink(u.number, pending ? usbip_status::kUnlinked : usbip_status::kDone));
  }

  // Whether the host took the transfer back before it came.
  bool taken_back(const UsbIpSubmit& s) {
    const std::lock_guard lock(mutex);
    newest = s.number;
    const auto found = std::find_if(ahead_of_time.begin(), ahead_of_time.end(),
                                    [&](const UsbIpUnlink& u) { return u.of == s.number; });
    if (found == ahead_of_time.end()) return false;
    write(usbip_ret_unlink(found->number, usbip_status::kUnlinked));
    ahead_of_time.erase(found);
    return true;
  }

  bool serve_one() {
    std::array<std::uint8_t, kUsbIpHeader> header{};
    if (!read(header)) return false;
    const auto request = parse_usbip(header);
    if (!request) return false;
    if (request->unlink) {
      unlink(*request->unlink);
      return true;
    }
    const UsbIpSubmit& s = *request->submit;
    if (s.length > kMostBytes || s.iso_packets > kMostBytes / kIsoDescriptor) return false;
    std::vector<std::uint8_t> data(s.in ? 0 : s.length);
    std::vector<std::uint8_t> iso(std::size_t{s.iso_packets} * kIsoDescriptor);
    if (!read(data) || !read(iso)) return false;
    if (!taken_back(s)) submit(s, data);
    return true;
  }
};

UsbIpDevice::UsbIpDevice(int socket, ControlHandler control, OutHandler out)
    : impl_(std::make_unique<Impl>(socket, std::move(control), std::move(out))) {
  impl_->thread = std::thread([impl = impl_.get()] {
    while (impl->serve_one()) {
    }
    impl->ended = true;
    // The host is told, too, when it was the one that said something odd.
    ::shutdown(impl->socket, SHUT_RDWR);
  });
}

UsbIpDevice::~UsbIpDevice() {
  ::shutdown(impl_->socket, SHUT_RDWR);
  impl_->thread.join();
  ::close(impl_->socket);
}

void UsbIpDevice::send(std::uint8_t endpoint, std::vector<std::uint8_t> data) {
  const std::lock_guard lock(impl_->mutex);
  impl_->queued.push_back({endpoint, std::move(data)});
  impl_->match();
}

std::size_t UsbIpDevice::unfetched(std::uint8_t endpoint) const {
  const std::lock_guard lock(impl_->mutex);
  return static_cast<std::size_t>(
      std::count_if(impl_->queued.begin(), impl_->queued.end(),
                    [endpoint](const Queued& each) { return each.endpoint == endpoint; }));
}

void UsbIpDevice::forget(std::uint8_t endpoint) {
  const std::lock_guard lock(impl_->mutex);
  std::erase_if(impl_->queued, [endpoint](const Queued& each) { return each.endpoint == endpoint; });
}

bool UsbIpDevice::ended() const {
  return impl_->ended;
}

}  // namespace rig::sim::wire
