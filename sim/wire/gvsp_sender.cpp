#include "sim/wire/gvsp_sender.h"

#include <algorithm>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace rig::sim::wire {

namespace {

constexpr std::size_t kKeptFrames = 4;

}  // namespace

GvspSender::GvspSender() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

GvspSender::~GvspSender() {
  ::close(fd_);
}

void GvspSender::transmit(const sockaddr_in& to, const Packet& packet) const {
  (void)::sendto(fd_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

void GvspSender::send(const sockaddr_in& to, std::uint16_t frame, std::vector<Packet> packets, int times,
                      double loss) {
  const std::lock_guard lock(mutex_);
  std::bernoulli_distribution is_lost(loss);
  for (const Packet& packet : packets) {
    for (int i = 0; i < times; ++i) {
      if (!is_lost(dice_)) transmit(to, packet);
    }
  }
  kept_.push_back({to, frame, std::move(packets)});
  if (kept_.size() > kKeptFrames) kept_.pop_front();
}

void GvspSender::send_again(const ResendRequest& request, double loss) {
  const std::lock_guard lock(mutex_);
  const auto sent =
      std::find_if(kept_.rbegin(), kept_.rend(), [&](const Sent& s) { return s.frame == request.frame; });
  if (kept_.empty()) return;
  if (sent == kept_.rend() || request.first >= sent->packets.size()) {
    transmit(kept_.back().to, unavailable_packet(request.frame, request.first));
    return;
  }
  std::bernoulli_distribution is_lost(loss);
  const std::size_t end = std::min<std::size_t>(sent->packets.size(), std::size_t{request.last} + 1);
  for (std::size_t i = request.first; i < end; ++i) {
    if (!is_lost(dice_again_)) transmit(sent->to, sent->packets[i]);
  }
}

}  // namespace rig::sim::wire
