// The simulated USB video camera over its control endpoint: descriptors, controls, negotiation.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/wire/uvc_camera.h"
#include "sim/wire/uvc_orders.h"
#include "tests/sim/wire/uvc_host.h"

namespace rig::sim::wire {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr long kStalled = -1;

class Uvc : public testing::Test {
 protected:
  UvcCamera camera{"00000042"};
  VideoHost<UvcCamera> host{camera};

  Bytes descriptor(std::uint16_t which, std::uint16_t length) {
    return camera.control({0x80, 6, which, 0, length}, {}).data;
  }
};

struct Piece {
  std::uint8_t type = 0, subtype = 0;
  Bytes bytes;
};

// Splits a configuration by the lengths that its descriptors begin with.
std::vector<Piece> pieces_of(const Bytes& all) {
  std::vector<Piece> pieces;
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t length = all[at];
    if (length < 3 || at + length > all.size()) {
      ADD_FAILURE() << "a descriptor of " << length << " bytes at " << at << " of " << all.size();
      break;
    }
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(at);
    pieces.push_back({all[at + 1], all[at + 2], Bytes(begin, begin + static_cast<std::ptrdiff_t>(length))});
    at += length;
  }
  return pieces;
}

std::size_t class_bytes_after(const std::vector<Piece>& pieces, std::size_t interface) {
  std::size_t sum = 0;
  for (std::size_t i = interface + 1; i < pieces.size() && pieces[i].type == 0x24; ++i)
    sum += pieces[i].bytes.size();
  return sum;
}

TEST_F(Uvc, TheDeviceIsAnAssociationOfInterfaces) {
  const Bytes device = descriptor(0x0100, 18);
  ASSERT_EQ(device.size(), 18U);
  EXPECT_EQ(device[0], 18);
  EXPECT_THAT(Bytes(device.begin() + 4, device.begin() + 8), ElementsAre(0xEF, 2, 1, 64));
  const Bytes serial =
      camera.control({0x80, 6, static_cast<std::uint16_t>(0x0300 | device[16]), 0x0409, 255}, {}).data;
  EXPECT_EQ(serial.size(), 2U + 2 * 8);
}

TEST_F(Uvc, TheConfigurationAddsUp) {
  const Bytes all = descriptor(0x0200, 0xFFFF);
  ASSERT_GE(all.size(), 9U);
  EXPECT_EQ(little(std::span(all).subspan(2, 2)), all.size());
  const auto pieces = pieces_of(all);
  std::vector<std::size_t> interfaces;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].type == 4) interfaces.push_back(i);
  }
  ASSERT_EQ(interfaces.size(), 2U);
  EXPECT_EQ(all[4], 2);
  EXPECT_EQ(pieces[1].bytes, (Bytes{8, 0x0B, 0, 2, 0x0E, 3, 0, 0})) << "the association";
  for (std::size_t i = 0; i < 2; ++i) {
    const Bytes& b = pieces[interfaces[i]].bytes;
    EXPECT_EQ(b[2], i);
    EXPECT_EQ(b[3], 0) << "one alternate setting";
    EXPECT_EQ(b[4], 1) << "one endpoint";
    EXPECT_EQ(b[5], 0x0E);
    EXPECT_EQ(b[6], i + 1);
  }
  const Piece& control = pieces[interfaces[0] + 1];
  EXPECT_EQ(control.subtype, 1);
  EXPECT_EQ(little(std::span(control.bytes).subspan(3, 2)), 0x0110U);
  EXPECT_EQ(little(std::span(control.bytes).subspan(5, 2)), class_bytes_after(pieces, interfaces[0]));
  const Piece& streaming = pieces[interfaces[1] + 1];
  EXPECT_EQ(streaming.subtype, 1);
  EXPECT_EQ(little(std::span(streaming.bytes).subspan(4, 2)), class_bytes_after(pieces, interfaces[1]));
  EXPECT_EQ(streaming.bytes[6], 0x81);
  EXPECT_EQ(streaming.bytes.size(), 13U + streaming.bytes[3] * streaming.bytes[12]);
  EXPECT_EQ(pieces.back().bytes, (Bytes{7, 5, 0x81, 2, 0, 2, 0})) << "a bulk endpoint";
}

TEST_F(Uvc, TheChainGoesFromTheCameraToTheStream) {
  const auto pieces = pieces_of(descriptor(0x0200, 0xFFFF));
  Bytes camera_terminal, unit, output;
  for (const Piece& p : pieces) {
    if (p.type != 0x24) continue;
    if (p.subtype == 2) camera_terminal = p.bytes;
    if (p.subtype == 5 && p.bytes.size() == 12) unit = p.bytes;
    if (p.subtype == 3 && p.bytes.size() == 9) output = p.bytes;
  }
  ASSERT_EQ(camera_terminal.size(), 18U);
  EXPECT_EQ(little(std::span(camera_terminal).subspan(4, 2)), 0x0201U);
  EXPECT_EQ(little(std::span(camera_terminal).subspan(15, 3)), 0x0EU);
  ASSERT_EQ(unit.size(), 12U);
  EXPECT_EQ(unit[4], camera_terminal[3]);
  EXPECT_EQ(little(std::span(unit).subspan(8, 2)), 0x0201U);
  ASSERT_EQ(output.size(), 9U);
  EXPECT_EQ(little(std::span(output).subspan(4, 2)), 0x0101U);
  EXPECT_EQ(output[7], unit[3]);
}

TEST_F(Uvc, FormatsAndFramesAreWhatTheProbeSays) {
  std::uint8_t format = 0, bits = 0;
  std::vector<std::string> names;
  int frames = 0;
  for (const Piece& p : pieces_of(descriptor(0x0200, 0xFFFF))) {
    if (p.type != 0x24) continue;
    if (p.subtype == 4 && p.bytes.size() == 27) {
      format = p.bytes[3];
      bits = p.bytes[21];
      names.emplace_back(p.bytes.begin() + 5, p.bytes.begin() + 9);
      EXPECT_EQ(p.bytes[4], 2) << "frames";
    }
    if (p.subtype != 5 || p.bytes.size() < 30) continue;
    const std::span b(p.bytes);
    ++frames;
    EXPECT_EQ(p.bytes.size(), 26U + 4U * p.bytes[25]);
    const std::uint32_t bytes = little(b.subspan(5, 2)) * little(b.subspan(7, 2)) * bits / 8;
    EXPECT_EQ(little(b.subspan(17, 4)), bytes);
    for (std::size_t i = 0; i < p.bytes[25]; ++i) {
      const std::uint32_t interval = little(b.subspan(26 + 4 * i, 4));
      ASSERT_EQ(host.tell(kProbe, host.block(format, p.bytes[3], interval)).kind, ControlAnswer::Kind::done);
      const Bytes agreed = host.ask(get_cur, kProbe).data;
      ASSERT_EQ(agreed.size(), 34U);
      EXPECT_EQ(agreed[2], format);
      EXPECT_EQ(agreed[3], p.bytes[3]);
      EXPECT_EQ(little(std::span(agreed).subspan(4, 4)), interval);
      EXPECT_EQ(little(std::span(agreed).subspan(18, 4)), bytes);
      EXPECT_EQ(little(std::span(agreed).subspan(22, 4)), 16384U);
    }
  }
  EXPECT_EQ(frames, 8);
  EXPECT_THAT(names, ElementsAre("Y8  ", "Y12 ", "Y16 ", "RGGB"));
}

TEST_F(Uvc, ControlsTellTheirRange) {
  struct Row {
    Target of;
    long least, most, resolution, initial, info;
  };
  for (const Row& r : {Row{kExposure, 1, 20000, 1, 156, 0x0F}, Row{kGain, 16, 255, 1, 16, 3},
                       Row{kBrightness, 0, 255, 1, 64, 3}, Row{kAeMode, kStalled, kStalled, 9, 8, 3},
                       Row{kAePriority, kStalled, kStalled, kStalled, kStalled, 3}}) {
    SCOPED_TRACE(testing::Message() << "entity " << int{r.of.entity} << " selector " << int{r.of.selector});
    EXPECT_EQ(host.get(get_min, r.of), r.least);
    EXPECT_EQ(host.get(get_max, r.of), r.most);
    EXPECT_EQ(host.get(get_res, r.of), r.resolution);
    EXPECT_EQ(host.get(get_def, r.of), r.initial);
    EXPECT_EQ(host.get(get_info, r.of), r.info);
    EXPECT_EQ(host.get(get_len, r.of), r.of.bytes);
  }
}

TEST_F(Uvc, TheHostSetsTheExposureInTheManualModeOnly) {
  EXPECT_EQ(host.get(get_cur, kAeMode), 8) << "aperture priority";
  EXPECT_FALSE(host.set(kExposure, 100));
  EXPECT_EQ(host.error(), 2) << "wrong state";
  EXPECT_TRUE(host.set(kAeMode, 1));
  EXPECT_EQ(host.error(), 0) << "the last request was good";
  EXPECT_EQ(host.get(get_info, kExposure), 0x0B);
  EXPECT_TRUE(host.set(kExposure, 100));
  EXPECT_EQ(host.get(get_cur, kExposure), 100);
  EXPECT_EQ(camera.state().exposures_set, 1);
  EXPECT_TRUE(host.set(kGain, 40));
  EXPECT_TRUE(host.set(kBrightness, 9));
  EXPECT_TRUE(host.set(kAePriority, 1));
  EXPECT_EQ(camera.state().settings, (UvcSettings{100, 40, 9}));
  EXPECT_EQ(host.get(get_cur, kAePriority), 1);
}

TEST_F(Uvc, WrongRequestsStallAndSayWhy) {
  ASSERT_TRUE(host.set(kAeMode, 1));
  for (const std::uint32_t value : {0U, 20001U, 0xFFFFFFFFU})
    EXPECT_FALSE(host.set(kExposure, value)) << value;
  EXPECT_EQ(host.error(), 4) << "out of range";
  EXPECT_EQ(host.error(), 4) << "reading it changes nothing";
  for (const std::uint32_t value : {0U, 2U, 4U, 9U}) EXPECT_FALSE(host.set(kAeMode, value)) << value;
  EXPECT_FALSE(host.set(kAePriority, 2));
  EXPECT_FALSE(host.set(kGain, 15));
  EXPECT_FALSE(host.set(kBrightness, 256));
  EXPECT_EQ(host.error(), 4);
  EXPECT_EQ(host.get(get_cur, {0, 7, 4, 4}), kStalled);
  EXPECT_EQ(host.error(), 5) << "no such unit";
  EXPECT_EQ(host.get(get_cur, {0, 1, 6, 2}), kStalled) << "focus";
  EXPECT_EQ(host.error(), 6) << "no such control";
  EXPECT_EQ(host.get(get_cur, {0, 3, 4, 4}), kStalled) << "the output terminal has none";
  EXPECT_EQ(host.error(), 6);
  EXPECT_EQ(host.get(get_cur, {0, 0, 1, 1}), kStalled) << "power mode";
  EXPECT_EQ(host.error(), 6);
  EXPECT_EQ(host.tell(kExposure, {1, 0}).kind, ControlAnswer::Kind::stall) << "too short";
  EXPECT_EQ(host.error(), 7) << "not such a request";
  EXPECT_EQ(host.get(static_cast<Request>(0x88), kExposure), kStalled);
  EXPECT_EQ(host.error(), 7);
  EXPECT_EQ(host.tell(kError, {0}).kind, ControlAnswer::Kind::stall) << "can only be read";
  EXPECT_EQ(host.error(), 7);
  EXPECT_EQ(host.get(get_info, kError), 1);
  EXPECT_EQ(camera.control({0xC0, 1, 0, 0, 4}, {}).kind, ControlAnswer::Kind::stall) << "a vendor's request";
  EXPECT_EQ(host.get(get_cur, kExposure), 156) << "nothing of this was done";
}

TEST_F(Uvc, AProbeIsAnsweredWithWhatComesNext) {
  const Bytes initial = host.ask(get_def, kProbe).data;
  ASSERT_EQ(initial.size(), 34U);
  EXPECT_EQ(host.get(get_len, kProbe), 34);
  EXPECT_EQ(host.get(get_info, kProbe), 3);
  ASSERT_EQ(host.tell(kProbe, host.block(9, 0, 900'000)).kind, ControlAnswer::Kind::done);
  const Bytes agreed = host.ask(get_cur, kProbe).data;
  EXPECT_EQ(agreed[2], 1);
  EXPECT_EQ(agreed[3], 1);
  EXPECT_EQ(little(std::span(agreed).subspan(4, 4)), 1'000'000U);
  EXPECT_EQ(little(std::span<const std::uint8_t>(host.ask(get_min, kProbe).data).subspan(4, 4)), 333'333U);
  EXPECT_EQ(little(std::span<const std::uint8_t>(host.ask(get_max, kProbe).data).subspan(4, 4)), 2'000'000U);
  EXPECT_EQ(host.get(get_min, kCommit), kStalled);
  EXPECT_EQ(host.tell(kCommit, host.block(2, 1, 1'000'000)).kind, ControlAnswer::Kind::stall);
  EXPECT_EQ(host.error(), 4) << "that was not agreed upon";
  EXPECT_FALSE(camera.state().streaming);
  EXPECT_EQ(host.tell(kProbe, Bytes(26)).kind, ControlAnswer::Kind::stall) << "a block of version 1.0";
  EXPECT_EQ(host.error(), 7);
  EXPECT_EQ(host.tell(kCommit, agreed).kind, ControlAnswer::Kind::done);
  EXPECT_TRUE(camera.state().streaming);
  EXPECT_EQ(host.ask(get_cur, kCommit).data, agreed);
  EXPECT_EQ(host.get(get_cur, {1, 0, 3, 1}), kStalled) << "still pictures";
  EXPECT_EQ(host.error(), 6);
  EXPECT_EQ(host.get(get_cur, {2, 0, 1, 34}), kStalled) << "there is no such interface";
}

TEST_F(Uvc, RequestsStallAreIgnoredOrSlowOnCommand) {
  const auto order = [&](const std::string& line) { return carry_out_order(camera, line); };
  ASSERT_TRUE(order("stall 2 1"));
  EXPECT_EQ(host.get(get_cur, kGain), kStalled);
  EXPECT_EQ(host.error(), 1) << "not ready; asking does not count";
  EXPECT_FALSE(host.set(kGain, 20));
  EXPECT_EQ(host.get(get_cur, kGain), 16);
  ASSERT_TRUE(order("ignore 1"));
  EXPECT_EQ(host.ask(get_cur, kGain).kind, ControlAnswer::Kind::silence);
  EXPECT_EQ(host.get(get_cur, kGain), 16);
  ASSERT_TRUE(order("slow 60"));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(host.get(get_cur, kGain), 16);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(60));
  ASSERT_TRUE(order("slow 0"));
  EXPECT_THAT(order("state").value(), HasSubstr("streaming 0 format 1"));
  EXPECT_THAT(order("").value(), IsEmpty());
  for (const char* line :
       {"stall", "stall 1", "stall one 2", "cut 1 -5", "delay 1 2", "dance 1", "state 1"}) {
    EXPECT_FALSE(order(line)) << line;
  }
}

TEST_F(Uvc, ThePowerIsGoneWithThePlug) {
  ASSERT_TRUE(host.set(kAeMode, 1));
  ASSERT_TRUE(host.set(kExposure, 77));
  host.start(3, 2, 400'000);
  EXPECT_TRUE(camera.state().streaming);
  camera.disconnect();
  EXPECT_FALSE(camera.state().streaming);
  EXPECT_EQ(host.get(get_cur, kAeMode), 8);
  EXPECT_EQ(host.get(get_cur, kExposure), 156);
  EXPECT_EQ(host.ask(get_cur, kProbe).data, host.ask(get_def, kProbe).data);
}

}  // namespace
}  // namespace rig::sim::wire
