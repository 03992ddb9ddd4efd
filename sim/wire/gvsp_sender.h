// Sends the packets of frames, loses some of them, and sends again what is asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <netinet/in.h>
#include <random>
#include <vector>

#include "sim/wire/gvcp_resend.h"
#include "sim/wire/gvsp.h"

namespace rig::sim::wire {

/// Any thread may call it. Which packets of frames are lost is the same each time, whatever is sent again.
class GvspSender {
 public:
  GvspSender();
  ~GvspSender();
  GvspSender(const GvspSender&) = delete;
  GvspSender& operator=(const GvspSender&) = delete;

  /// All packets of a frame, each so many times; of those so large a share never arrives.
  void send(const sockaddr_in& to, std::uint16_t frame, std::vector<Packet> packets, int times, double loss);
  /// Of the last few frames, to where they went. What is not there is answered so, as GigE Vision has it.
  void send_again(const ResendRequest& request, double loss);

 private:
  struct Sent {
    sockaddr_in to{};
    std::uint16_t frame = 0;
    std::vector<Packet> packets;
  };

  void transmit(const sockaddr_in& to, const Packet& packet) const;

  std::mutex mutex_;
  const int fd_;
  std::mt19937 dice_{1}, dice_again_{2};
  std::deque<Sent> kept_;
};

}  // namespace rig::sim::wire
