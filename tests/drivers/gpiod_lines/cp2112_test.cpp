// The simulated CP2112, report by report, as the kernel's driver talks to it.
#include "sim/wire/cp2112.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/wire/cp2112_orders.h"

namespace rig::sim::wire {
namespace {

using testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;
using Kind = ControlAnswer::Kind;

constexpr std::uint16_t kFeature = 0x0300;

class Cp2112Reports : public testing::Test {
 protected:
  [[nodiscard]] ControlAnswer get(std::uint8_t report) {
    return chip_.control({0xA1, 1, static_cast<std::uint16_t>(kFeature | report), 0, 64}, {});
  }
  [[nodiscard]] bool set(const Bytes& report) {
    return chip_
               .control({0x21, 9, static_cast<std::uint16_t>(kFeature | report[0]), 0,
                         static_cast<std::uint16_t>(report.size())},
                        report)
               .kind == Kind::done;
  }
  [[nodiscard]] Bytes descriptor(std::uint8_t request_type, std::uint16_t value) {
    const auto answer = chip_.control({request_type, 6, value, 0, 0xFFFF}, {});
    EXPECT_EQ(answer.kind, Kind::done);
    return answer.data;
  }

  Cp2112 chip_{"00801234"};
};

TEST_F(Cp2112Reports, DescriptorsAgreeWithEachOther) {
  const Bytes device = descriptor(0x80, 0x0100);
  ASSERT_EQ(device.size(), 18U);
  EXPECT_EQ(device[4], 0);  // its class is its interface's
  EXPECT_EQ(device[8] + 256 * device[9], 0x10C4);
  EXPECT_EQ(device[10] + 256 * device[11], 0xEA90);
  const Bytes configuration = descriptor(0x80, 0x0200);
  EXPECT_EQ(configuration[2] + 256 * configuration[3], static_cast<int>(configuration.size()));
  // Each descriptor begins with its own length: configuration, interface, HID, two endpoints.
  std::vector<int> types;
  for (std::size_t at = 0; at < configuration.size(); at += configuration[at]) {
    types.push_back(configuration[at + 1]);
  }
  EXPECT_THAT(types, ElementsAre(2, 4, 0x21, 5, 5));
  EXPECT_EQ(configuration[9 + 5], 3);  // HID
  const Bytes hid = descriptor(0x81, 0x2100);
  const Bytes reports = descriptor(0x81, 0x2200);
  EXPECT_EQ(hid[7] + 256 * hid[8], static_cast<int>(reports.size()));
  EXPECT_TRUE(std::equal(hid.begin(), hid.end(), configuration.begin() + 18));
  EXPECT_EQ(reports.back(), 0xC0);
}

TEST_F(Cp2112Reports, WhatTheDriverAsksAtItsStart) {
  EXPECT_THAT(get(0x05).data, ElementsAre(0x05, 0x0C, 0x03));
  const Bytes smbus = get(0x06).data;
  ASSERT_EQ(smbus.size(), 14U);
  Bytes changed = smbus;
  changed[13] = 1;  // one retry
  EXPECT_TRUE(set(changed));
  EXPECT_EQ(get(0x06).data, changed);
  EXPECT_THAT(get(0x20).data, ElementsAre(0x20, 0));
  EXPECT_EQ(get(0x21).data.size(), 10U);
}

TEST_F(Cp2112Reports, PinsAreInputsUntilTheyAreConfigured) {
  EXPECT_THAT(get(0x02).data, ElementsAre(0x02, 0, 0, 0, 0));
  EXPECT_THAT(get(0x03).data, ElementsAre(0x03, 0xFF));
  chip_.drive(3, false);
  EXPECT_THAT(get(0x03).data, ElementsAre(0x03, 0xF7));
  EXPECT_TRUE(set({0x04, 0x00, 0xFF}));  // latches of inputs are not set
  EXPECT_THAT(get(0x03).data, ElementsAre(0x03, 0xF7));
}

TEST_F(Cp2112Reports, OutputsArePushPullOrOpenDrain) {
  EXPECT_TRUE(set({0x02, 0x03, 0x01, 0, 0}));
  EXPECT_TRUE(chip_.is_output(0));
  EXPECT_FALSE(chip_.is_output(2));
  EXPECT_TRUE(set({0x04, 0x00, 0x03}));
  EXPECT_FALSE(chip_.high(0));
  EXPECT_FALSE(chip_.high(1));
  EXPECT_TRUE(set({0x04, 0xFF, 0x01}));
  EXPECT_TRUE(chip_.high(0));
  EXPECT_FALSE(chip_.high(1));
  EXPECT_EQ(chip_.changes(0).size(), 2U);
  EXPECT_TRUE(chip_.changes(0).empty());
  chip_.drive(1, true);  // somebody holds it
  EXPECT_TRUE(chip_.high(1));
  EXPECT_THAT(get(0x02).data, ElementsAre(0x02, 0x03, 0x01, 0, 0));
  chip_.power_cycle();
  EXPECT_FALSE(chip_.is_output(0));
}

TEST_F(Cp2112Reports, WhatItDoesNotKnowStalls) {
  EXPECT_EQ(get(0x77).kind, Kind::stall);
  EXPECT_FALSE(set({0x04, 0x00}));
  EXPECT_FALSE(set({0x02, 1, 1, 1, 1, 1}));
  EXPECT_FALSE(set({0x03, 1}));
  EXPECT_EQ(chip_.control({0xC0, 1, 0, 0, 1}, {}).kind, Kind::stall);
  chip_.stall_next(1);
  EXPECT_EQ(get(0x03).kind, Kind::stall);
  EXPECT_EQ(get(0x03).kind, Kind::done);
}

TEST_F(Cp2112Reports, Orders) {
  EXPECT_EQ(carry_out_order(chip_, "show 2").value(), "input high");
  EXPECT_EQ(carry_out_order(chip_, "drive 2 low").value(), "");
  EXPECT_EQ(carry_out_order(chip_, "show 2").value(), "input low");
  EXPECT_EQ(carry_out_order(chip_, "drive 2 free").value(), "");
  EXPECT_TRUE(chip_.high(2));
  EXPECT_EQ(carry_out_order(chip_, "stall 1").value(), "");
  EXPECT_EQ(get(0x03).kind, Kind::stall);
  for (const char* wrong :
       {"", "drive", "drive 2", "drive 9 low", "drive 1 up", "show x", "show 8", "stall", "jump"}) {
    EXPECT_FALSE(carry_out_order(chip_, wrong)) << wrong;
  }
}

}  // namespace
}  // namespace rig::sim::wire
