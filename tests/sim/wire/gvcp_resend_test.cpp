// Requests for packets that did not come, byte by byte, and what is sent on them.
#include "sim/wire/gvcp_resend.h"

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

#include "sim/wire/gvsp_sender.h"

namespace rig::sim::wire {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using Bytes = std::vector<std::uint8_t>;

// Key, flags, command, length, number of the request; stream, frame, first and last packet.
Bytes request(std::uint8_t frame, std::uint8_t first, std::uint8_t last) {
  return {0x42, 0, 0, 0x40, 0, 12, 0xff, 0x17, 0, 0, 0, frame, 0, 0, 0, first, 0, 0, 0, last};
}

TEST(GvcpResend, ARequestIsRead) {
  EXPECT_EQ(read_resend_request(request(7, 3, 5)), (ResendRequest{7, 3, 5}));
  Bytes to_the_end = request(7, 3, 0xff);
  to_the_end[17] = to_the_end[18] = 0xff;
  EXPECT_EQ(read_resend_request(to_the_end), (ResendRequest{7, 3, kToTheEnd}));
}

TEST(GvcpResend, WhatIsNoRequestOfThisStreamIsNone) {
  const auto changed = [](std::size_t at, std::uint8_t to) {
    Bytes bytes = request(7, 3, 5);
    bytes[at] = to;
    return read_resend_request(bytes);
  };
  EXPECT_EQ(changed(0, 0x43), std::nullopt) << "key";
  EXPECT_EQ(changed(1, 0x10), std::nullopt) << "64-bit numbers";
  EXPECT_EQ(changed(3, 0x80), std::nullopt) << "another command";
  EXPECT_EQ(changed(5, 20), std::nullopt) << "length";
  EXPECT_EQ(changed(9, 1), std::nullopt) << "stream";
  EXPECT_EQ(changed(11, 0), std::nullopt) << "no frame has the number 0";
  EXPECT_EQ(changed(19, 2), std::nullopt) << "last before first";
  EXPECT_EQ(changed(16, 1), std::nullopt) << "a number of more than 24 bits";
  Bytes bytes = request(7, 3, 5);
  bytes[6] = bytes[7] = 0;
  EXPECT_EQ(read_resend_request(bytes), std::nullopt) << "no request has the number 0";
  bytes = request(7, 3, 5);
  bytes.pop_back();
  EXPECT_EQ(read_resend_request(bytes), std::nullopt);
  EXPECT_EQ(read_resend_request({}), std::nullopt);
}

class GvspSending : public testing::Test {
 protected:
  GvspSending() {
    socklen_t size = sizeof to_;
    to_.sin_family = AF_INET;
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&to_), sizeof to_), 0);
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&to_), &size), 0);
  }
  ~GvspSending() override { ::close(fd_); }

  // On the loopback interface what was sent is there.
  std::vector<Bytes> received() {
    std::vector<Bytes> packets;
    Bytes packet(2000);
    for (ssize_t n = 0; (n = ::recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT)) > 0;)
      packets.emplace_back(packet.begin(), packet.begin() + n);
    return packets;
  }

  const int fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to_{};
  GvspSender sender_;
};

TEST_F(GvspSending, SendsAgainWhatItIsAskedFor) {
  sender_.send(to_, 7, {{1}, {2}, {3}, {4}}, 1, 0);
  EXPECT_THAT(received(), ElementsAre(Bytes{1}, Bytes{2}, Bytes{3}, Bytes{4}));
  sender_.send_again({7, 1, 2}, 0);
  EXPECT_THAT(received(), ElementsAre(Bytes{2}, Bytes{3}));
  sender_.send_again({7, 2, kToTheEnd}, 0);
  EXPECT_THAT(received(), ElementsAre(Bytes{3}, Bytes{4}));
  sender_.send_again({7, 0, 3}, 1);
  EXPECT_THAT(received(), IsEmpty()) << "it is lost again";
}

TEST_F(GvspSending, SaysWhatItHasNoMore) {
  for (std::uint16_t frame = 1; frame <= 5; ++frame) sender_.send(to_, frame, {{1}}, 1, 1);
  EXPECT_THAT(received(), IsEmpty());
  const auto unavailable = [](std::uint8_t frame, std::uint8_t packet) {
    return Bytes{0x80, 0x0c, 0, frame, 3, 0, 0, packet};
  };
  sender_.send_again({1, 0, 0}, 0);
  EXPECT_THAT(received(), ElementsAre(unavailable(1, 0))) << "too long ago";
  sender_.send_again({5, 1, 1}, 0);
  EXPECT_THAT(received(), ElementsAre(unavailable(5, 1))) << "it never had so many";
}

// Losing more of what is sent again changes nothing in which packets of frames are lost.
TEST_F(GvspSending, LosesTheSamePacketsOfFramesEachTime) {
  const auto lost = [&](bool again) {
    GvspSender sender;
    std::vector<Bytes> all;
    for (std::uint16_t frame = 1; frame <= 20; ++frame) {
      sender.send(to_, frame, {{1}, {2}, {3}, {4}}, 1, 0.5);
      for (const Bytes& packet : received()) all.push_back(packet);
      if (again) sender.send_again({frame, 0, kToTheEnd}, 0.5);
      (void)received();
    }
    return all;
  };
  const auto first = lost(false);
  EXPECT_GT(first.size(), 20U);
  EXPECT_LT(first.size(), 60U);
  EXPECT_EQ(lost(true), first);
}

}  // namespace
}  // namespace rig::sim::wire
