// Whatever frames a CAN bus brings: transfers, what nodes say unasked, and error frames are read, or passed
// over.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "drivers/cia402_axis/can_errors.h"
#include "drivers/cia402_axis/node_monitor.h"
#include "drivers/cia402_axis/sdo.h"
#include "drivers/cia402_axis/statusword.h"

namespace {

using namespace rig::drivers::cia402;  // NOLINT(google-build-using-namespace): this program is about nothing
                                       // else

constexpr int kNode = 5;
constexpr std::size_t kLongest = 4096;

void require(bool met) {
  if (!met) std::abort();
}

// Most frames are to be the node's own: a kind, then up to 8 bytes.
can_frame next_frame(const std::uint8_t*& data, std::size_t& size) {
  constexpr canid_t kIds[] = {0x580 + kNode, 0x700 + kNode, 0x080 + kNode, 0x580,
                              CAN_ERR_FLAG,  CAN_EFF_FLAG,  0x600 + kNode, 0};
  const std::uint8_t kind = data[0];
  can_frame frame{};
  frame.can_id = kIds[kind & 7U];
  if (frame.can_id == CAN_ERR_FLAG && size > 1) frame.can_id |= static_cast<canid_t>(data[1]) << (kind >> 6U);
  // Of eight frames one is short.
  frame.can_dlc = static_cast<std::uint8_t>((kind & 0x38U) == 0 ? kind >> 6U : 8);
  const std::size_t bytes = std::min<std::size_t>(size - 1, 8);
  std::memcpy(frame.data, data + 1, bytes);
  data += 1 + bytes;
  size -= 1 + bytes;
  return frame;
}

void check(const SdoTransfer& transfer, const std::optional<can_frame>& next) {
  require(transfer.bytes().size() <= kLongest + 7);
  require((transfer.state() == SdoTransfer::State::failed) == !transfer.error().what.empty());
  if (next) require(next->can_id == 0x600 + kNode && next->can_dlc == 8);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const Object object{static_cast<std::uint16_t>(data[0] | data[1] << 8U), data[2]};
  SdoTransfer upload = SdoTransfer::upload(kNode, object);
  SdoTransfer download =
      SdoTransfer::download(kNode, object, {reinterpret_cast<const char*>(data), data[3] & 3U});
  NodeMonitor monitor(kNode);
  NodeMonitor::Time now{};
  monitor.expect_heartbeats(now, std::chrono::milliseconds(300));
  data += 4;
  size -= 4;
  while (size > 0) {
    const std::uint8_t kind = data[0];
    const can_frame frame = next_frame(data, size);
    now += std::chrono::milliseconds(kind);
    const bool was_over = upload.state() != SdoTransfer::State::waiting;
    const auto next = upload.hear(frame);
    require(!was_over || !next);
    check(upload, next);
    check(download, download.hear(frame));
    monitor.hear(frame, now);
    (void)monitor.is_overdue(now);
    if (monitor.emergency()) require(!text_of(*monitor.emergency()).empty());
    if ((kind & 0x10U) != 0) monitor.told();
    const BusNews news = read_error_frame(frame);
    require((news.event == BusEvent::nothing) == news.text.empty());
    if (upload.state() == SdoTransfer::State::done && upload.bytes().size() >= 2) {
      std::uint16_t statusword = 0;
      std::memcpy(&statusword, upload.bytes().data(), sizeof statusword);
      const Power power = power_of(statusword);
      require(*text_of(power) != '\0');
      if (const auto word = towards_operation(power, (kind & 1U) != 0))
        require(*word <= control::kEnableOperation);
    }
    // A client asks again and again.
    if (upload.state() != SdoTransfer::State::waiting) upload = SdoTransfer::upload(kNode, object);
    if (download.state() != SdoTransfer::State::waiting)
      download = SdoTransfer::download(kNode, object, "ab");
  }
  return 0;
}
