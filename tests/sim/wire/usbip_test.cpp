// The USB/IP framing against a host written by hand: what the kernel's virtual host controller sends and
// expects, byte by byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mutex>
#include <thread>

#include "sim/wire/tic.h"
#include "sim/wire/usbip_frames.h"
#include "sim/wire/vhci.h"
#include "tests/core/temporary_folder.h"
#include "tests/sim/wire/usbip_host.h"

namespace rig::sim::wire {
namespace {

using std::chrono::milliseconds;
using test::Bytes;
using test::Host;
using test::put32;
using testing::ElementsAre;
using testing::IsEmpty;

ControlAnswer echo(const SetupPacket& setup, std::span<const std::uint8_t> out) {
  switch (setup.request) {
    case 1:
      return {ControlAnswer::Kind::done, {1, 2, 3, 4, 5, 6}};
    case 2:
      return ControlAnswer::stalled();
    case 3:
      return {ControlAnswer::Kind::silence, {}};
    default:
      return {ControlAnswer::Kind::done, Bytes(out.begin(), out.end())};
  }
}

TEST(UsbIp, ARequestIsReadFromItsBytes) {
  Bytes b;
  for (const std::uint32_t word : {1U, 0x1234U, 0x10001U, 1U, 2U, 0x200U, 64U, 0U, 0xFFFFFFFFU, 0U})
    put32(b, word);
  const Bytes setup{0xC0, 0xA1, 0, 0, 0x22, 0, 4, 0};
  b.insert(b.end(), setup.begin(), setup.end());
  std::array<std::uint8_t, kUsbIpHeader> header{};
  std::copy(b.begin(), b.end(), header.begin());
  const auto request = parse_usbip(header);
  ASSERT_TRUE(request && request->submit);
  EXPECT_EQ(request->submit->number, 0x1234U);
  EXPECT_EQ(request->submit->device, 0x10001U);
  EXPECT_TRUE(request->submit->in);
  EXPECT_EQ(request->submit->endpoint, 2U);
  EXPECT_EQ(request->submit->length, 64U);
  EXPECT_EQ(request->submit->iso_packets, 0U);
  const SetupPacket packet = parse_setup(request->submit->setup);
  EXPECT_EQ(packet, (SetupPacket{0xC0, 0xA1, 0, 0x22, 4}));
  EXPECT_EQ(bytes_of(packet), request->submit->setup);
  header[3] = 7;
  EXPECT_FALSE(parse_usbip(header));
}

TEST(UsbIp, ControlTransfersTowardsTheHost) {
  const Host host(&echo);
  host.submit(1, true, 0, 4, {0xC0, 1, 0, 0, 0, 0, 4, 0});
  auto r = host.answer(true);
  EXPECT_EQ(r.command, 3U);
  EXPECT_EQ(r.number, 1U);
  EXPECT_EQ(r.status, 0);
  EXPECT_THAT(r.data, ElementsAre(1, 2, 3, 4)) << "no more than was asked for";
  host.submit(2, true, 0, 64, {0xC0, 1, 0, 0, 0, 0, 64, 0});
  EXPECT_THAT(host.answer(true).data, ElementsAre(1, 2, 3, 4, 5, 6)) << "and no more than there is";
  host.submit(3, true, 0, 64, {0xC0, 2, 0, 0, 0, 0, 64, 0});
  r = host.answer(true);
  EXPECT_EQ(r.status, -32) << "EPIPE";
  EXPECT_EQ(r.length, 0U);
}

TEST(UsbIp, ControlTransfersTowardsTheDevice) {
  Bytes taken;
  const Host host([&taken](const SetupPacket& setup, std::span<const std::uint8_t> out) {
    taken.assign(out.begin(), out.end());
    EXPECT_EQ(setup.length, 3);
    return ControlAnswer{};
  });
  host.submit(9, false, 0, 3, {0x40, 9, 0, 0, 0, 0, 3, 0}, {7, 8, 9});
  const auto r = host.answer(false);
  EXPECT_EQ(r.number, 9U);
  EXPECT_EQ(r.status, 0);
  EXPECT_EQ(r.length, 3U);
  EXPECT_THAT(taken, ElementsAre(7, 8, 9));
}

TEST(UsbIp, WhatIsNotAnsweredIsUnlinked) {
  const Host host(&echo);
  host.submit(5, true, 0, 4, {0xC0, 3, 0, 0, 0, 0, 4, 0});
  EXPECT_TRUE(host.silent(milliseconds(50)));
  host.unlink(6, 5);
  auto r = host.answer(false);
  EXPECT_EQ(r.command, 4U);
  EXPECT_EQ(r.number, 6U);
  EXPECT_EQ(r.status, -104) << "ECONNRESET: and its answer will never come";
  EXPECT_TRUE(host.silent(milliseconds(50)));
  // One that was answered before.
  host.submit(7, true, 0, 4, {0xC0, 1, 0, 0, 0, 0, 4, 0});
  EXPECT_EQ(host.answer(true).number, 7U);
  host.unlink(8, 7);
  EXPECT_EQ(host.answer(false).status, 0);
}

// The kernel sends from two queues, so that it may take back what it has not sent yet.
TEST(UsbIp, AnUnlinkThatComesBeforeItsTransferWaitsForIt) {
  int handled = 0;
  const Host host([&handled](const SetupPacket&, std::span<const std::uint8_t>) {
    ++handled;
    return ControlAnswer{};
  });
  host.submit(5, false, 0, 0);
  EXPECT_EQ(host.answer(false).number, 5U);
  host.unlink(9, 7);
  EXPECT_TRUE(host.silent(milliseconds(50)));
  host.submit(6, true, 1, 4);
  host.submit(7, true, 1, 4);
  auto r = host.answer(false);
  EXPECT_EQ(r.command, 4U);
  EXPECT_EQ(r.number, 9U);
  EXPECT_EQ(r.status, -104);
  host.device->send(1, {1, 2});
  EXPECT_EQ(host.answer(true).number, 6U);
  host.device->send(1, {3, 4});
  EXPECT_TRUE(host.silent(milliseconds(50))) << "for number 7 nobody waits";
  // The same for a transfer towards the device: it is not carried out.
  host.unlink(12, 10);
  host.submit(10, false, 0, 0);
  EXPECT_EQ(host.answer(false).number, 12U);
  EXPECT_EQ(handled, 1);
}

TEST(UsbIp, WhatWasSentCanBeForgotten) {
  const Host host(&echo);
  host.device->send(1, {1, 2, 3, 4});
  host.device->send(1, {5});
  host.device->send(2, {6});
  EXPECT_EQ(host.device->unfetched(1), 2U);
  host.submit(1, true, 1, 3);
  EXPECT_THAT(host.answer(true).data, ElementsAre(1, 2, 3));
  EXPECT_EQ(host.device->unfetched(1), 2U) << "one byte of the first is left";
  host.device->forget(1);
  EXPECT_EQ(host.device->unfetched(1), 0U);
  host.submit(2, true, 1, 3);
  EXPECT_TRUE(host.silent(milliseconds(50)));
  host.device->send(1, {7});
  EXPECT_THAT(host.answer(true).data, ElementsAre(7));
  EXPECT_EQ(host.device->unfetched(2), 1U);
}

TEST(UsbIp, BulkAndInterruptEndpoints) {
  std::mutex mutex;
  std::vector<std::pair<int, Bytes>> taken;
  const Host host(&echo, [&](std::uint8_t endpoint, std::span<const std::uint8_t> data) {
    const std::lock_guard lock(mutex);
    taken.emplace_back(endpoint, Bytes(data.begin(), data.end()));
    return endpoint == 1;
  });
  host.submit(1, false, 1, 2, Bytes(8), {0xAA, 0xBB});
  EXPECT_EQ(host.answer(false).length, 2U);
  host.submit(2, false, 3, 1, Bytes(8), {0xCC});
  EXPECT_EQ(host.answer(false).status, -32);
  {
    const std::lock_guard lock(mutex);
    EXPECT_THAT(taken, ElementsAre(std::pair(1, Bytes{0xAA, 0xBB}), std::pair(3, Bytes{0xCC})));
  }
  // A transfer waits for data, data wait for a transfer, and more than fits goes into the next.
  host.submit(3, true, 1, 4);
  EXPECT_TRUE(host.silent(milliseconds(50)));
  host.device->send(2, {9});
  host.device->send(1, {1, 2, 3, 4, 5, 6});
  EXPECT_THAT(host.answer(true).data, ElementsAre(1, 2, 3, 4));
  host.submit(4, true, 1, 4);
  EXPECT_THAT(host.answer(true).data, ElementsAre(5, 6));
  host.submit(5, true, 2, 4);
  EXPECT_THAT(host.answer(true).data, ElementsAre(9));
}

TEST(UsbIp, IsochronousTransfersAreRefusedAndTheirDescriptorsPassedOver) {
  const Host host(&echo);
  host.submit(1, true, 1, 32, Bytes(8), Bytes(2 * 16), 2);
  EXPECT_EQ(host.answer(true).status, -71) << "EPROTO";
  host.submit(2, true, 0, 4, {0xC0, 1, 0, 0, 0, 0, 4, 0});
  EXPECT_EQ(host.answer(true).number, 2U);
}

TEST(UsbIp, MessagesInPieces) {
  const Host host(&echo);
  Bytes b;
  for (const std::uint32_t word : {1U, 1U, 0U, 0U, 0U, 0U, 2U, 0U, 0U, 0U}) put32(b, word);
  for (const int byte : {0x40, 9, 0, 0, 0, 0, 2, 0, 0x11, 0x22}) b.push_back(static_cast<std::uint8_t>(byte));
  for (const std::uint8_t byte : b) {
    host.send({byte});
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(host.answer(false).length, 2U);
}

TEST(UsbIp, NonsenseEndsTheConnection) {
  {
    const Host host(&echo);
    host.send(Bytes(48, 0xEE));
    EXPECT_THAT(host.receive(1), IsEmpty());
    EXPECT_TRUE(host.device->ended());
  }
  const Host host(&echo);
  host.submit(1, false, 0, 0x7FFFFFFF);  // two gigabytes would follow
  EXPECT_THAT(host.receive(1), IsEmpty());
  EXPECT_TRUE(host.device->ended());
}

// What the kernel does to every device that is plugged in, and then what a driver does.
TEST(UsbIp, ATicIsEnumeratedAndRead) {
  Tic tic({});
  const Host host(
      [&tic](const SetupPacket& s, std::span<const std::uint8_t> out) { return tic.control(s, out); });
  std::uint32_t number = 0;
  const auto in = [&](const SetupPacket& setup) {
    const auto bytes = bytes_of(setup);
    host.submit(++number, true, 0, setup.length, {bytes.begin(), bytes.end()});
    return host.answer(true);
  };
  const auto out = [&](const SetupPacket& setup) {
    const auto bytes = bytes_of(setup);
    host.submit(++number, false, 0, 0, {bytes.begin(), bytes.end()});
    return host.answer(false).status;
  };
  const Bytes device = in({0x80, 6, 0x0100, 0, 18}).data;
  ASSERT_EQ(device.size(), 18U);
  EXPECT_EQ(device[0], 18);
  EXPECT_EQ(device[8] | (device[9] << 8), 0x1FFB);
  EXPECT_EQ(device[10] | (device[11] << 8), 0x00B3);
  EXPECT_EQ(in({0x80, 6, 0x0100, 0, 8}).data.size(), 8U);
  EXPECT_EQ(out({0x00, 5, 2, 0, 0}), 0);
  const Bytes head = in({0x80, 6, 0x0200, 0, 9}).data;
  ASSERT_EQ(head.size(), 9U);
  const auto total = static_cast<std::uint16_t>(head[2] | (head[3] << 8));
  EXPECT_EQ(in({0x80, 6, 0x0200, 0, total}).data.size(), total);
  EXPECT_THAT(in({0x80, 6, 0x0300, 0, 255}).data, ElementsAre(4, 3, 9, 4));
  const Bytes serial = in({0x80, 6, static_cast<std::uint16_t>(0x0300 | device[16]), 0x0409, 255}).data;
  ASSERT_EQ(serial.size(), 2U + 2 * 8);
  EXPECT_EQ(serial[2], '0');
  EXPECT_EQ(serial[16], '6');
  EXPECT_EQ(in({0x80, 6, 0x0600, 0, 10}).status, -32) << "no device qualifier: it has one speed";
  EXPECT_EQ(out({0x00, 9, 1, 0, 0}), 0);
  EXPECT_THAT(in({0x80, 8, 0, 0, 1}).data, ElementsAre(1));
  EXPECT_EQ(out({0x00, 9, 2, 0, 0}), -32);
  EXPECT_EQ(in({0xC0, 0xA1, 0, 0, 0x55}).data.size(), 0x55U);
  EXPECT_EQ(out({0x40, 0x8C, 0, 0, 0}), 0);
  EXPECT_EQ(tic.feeds_seen(), 1);
  EXPECT_EQ(out({0x40, 0x77, 0, 0, 0}), -32);
}

TEST(Vhci, TheFirstFreePortOfTheTable) {
  const std::string head = "hub port sta spd dev      sockfd local_busid\n";
  EXPECT_EQ(free_vhci_port(head + "hs  0000 006 003 00010001 000003 3-1\n"
                                  "hs  0001 004 000 00000000 000000 0-0\n"
                                  "ss  0008 004 000 00000000 000000 0-0\n"),
            1);
  EXPECT_EQ(free_vhci_port(head + "hs  0000 006 003 00010001 000003 3-1\n"
                                  "ss  0008 004 000 00000000 000000 0-0\n"),
            std::nullopt);
  EXPECT_EQ(free_vhci_port("port sta spd dev      socket           local_busid\n"
                           "0000 006 000 00000000 0000000000000000 0-0\n"
                           "0012 004 000 00000000 0000000000000000 0-0\n"),
            12)
      << "as kernels before 4.14 print it";
  EXPECT_EQ(free_vhci_port(""), std::nullopt);
}

// A folder stands for sysfs: the line that the kernel expects, and a descriptor that is a socket in it.
TEST(Vhci, PlugsInAndOut) {
  const rig::test::TemporaryFolder sys;
  rig::test::put_bytes(sys / "status",
                       "hub port sta spd dev sockfd local_busid\nhs  0003 004 000 00000000 000000 0-0\n");
  rig::test::put_bytes(sys / "attach", "");
  rig::test::put_bytes(sys / "detach", "");
  auto plug = VhciPlug::plug_in(&echo, UsbSpeed::full, {}, sys.path());
  ASSERT_TRUE(plug) << plug.error().text();
  EXPECT_EQ((*plug)->port(), 3);
  int port = -1, fd = -1, speed = -1;
  unsigned device = 0;
  EXPECT_EQ(
      std::sscanf(rig::test::bytes_in(sys / "attach").c_str(), "%d %d %u %d", &port, &fd, &device, &speed),
      4);
  EXPECT_EQ(port, 3);
  EXPECT_GE(fd, 0);
  EXPECT_EQ(speed, 2);
  plug->reset();
  EXPECT_EQ(rig::test::bytes_in(sys / "detach"), "3");
}

TEST(Vhci, SaysWhatIsMissing) {
  const rig::test::TemporaryFolder sys;
  const auto none = VhciPlug::plug_in(&echo, UsbSpeed::full, {}, sys.path());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().text(), testing::HasSubstr("modprobe vhci-hcd"));
  rig::test::put_bytes(sys / "status", "hs  0000 006 000 00000000 000000 0-0\n");
  EXPECT_EQ(VhciPlug::plug_in(&echo, UsbSpeed::full, {}, sys.path()).error().code, base::ErrorCode::busy);
  rig::test::put_bytes(sys / "status", "hs  0000 004 000 00000000 000000 0-0\n");
  EXPECT_EQ(VhciPlug::plug_in(&echo, UsbSpeed::full, {}, sys.path()).error().code, base::ErrorCode::io);
}

}  // namespace
}  // namespace rig::sim::wire
