// GigE Vision's request for packets of a frame that did not come (GVCP, PACKETRESEND_CMD), and an ear for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <netinet/in.h>
#include <optional>
#include <span>
#include <thread>

namespace rig::sim::wire {

struct ResendRequest {
  std::uint16_t frame = 0;
  std::uint32_t first = 0, last = 0;  ///< numbers of packets; first <= last

  [[nodiscard]] bool operator==(const ResendRequest&) const = default;
};

/// `last` of a request for all packets from `first` on.
inline constexpr std::uint32_t kToTheEnd = 0xffffff;

/// What a datagram at the camera's port asks for: nothing where it is another command, names another stream
/// than the first, has 64-bit numbers, or contradicts itself.
[[nodiscard]] std::optional<ResendRequest> read_resend_request(std::span<const std::uint8_t> datagram);

/// Hears the requests that reach a camera of this machine, whose port another socket has: Aravis' simulated
/// camera drops them.
class ResendEar {
 public:
  using Asked = std::function<void(const ResendRequest&)>;

  /// `asked` is called on a thread of its own. nullptr: this process may not (CAP_NET_RAW).
  [[nodiscard]] static std::unique_ptr<ResendEar> listen(in_addr camera, Asked asked);
  ~ResendEar();
  ResendEar(const ResendEar&) = delete;
  ResendEar& operator=(const ResendEar&) = delete;

 private:
  ResendEar(int fd, Asked asked);
  void hear();

  const int fd_;
  const Asked asked_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace rig::sim::wire
