// The Tic's bytes, as its user's guide has them: blocks, errors, currents, step modes.
#include "drivers/tic_axis/protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "drivers/tic_axis/products.h"

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;

// A Tic that decelerates from 200 pulses/s, put down byte by byte at the offsets of the variable reference.
std::vector<std::uint8_t> variable_bytes() {
  std::vector<std::uint8_t> b(0x55, 0);
  b[0x00] = 4;                     // soft error
  b[0x01] = 0b0001'0111;           // energized, uncertain, forward limit, homing
  b[0x02] = 0xC0;                  // command timeout, safe start violation
  b[0x04] = 0x44, b[0x06] = 0x10;  // low VIN, command timeout; encoder skip
  b[0x09] = 1;                     // target position
  b[0x0A] = 0xD2, b[0x0B] = 0x02, b[0x0C] = 0x96, b[0x0D] = 0x49;  // 1,234,567,890: the guide's example
  b[0x0E] = 0xFF, b[0x0F] = 0xFF, b[0x10] = 0xFF, b[0x11] = 0xFF;  // -1
  b[0x16] = 0x80, b[0x17] = 0x84, b[0x18] = 0x1E;                  // max speed 2,000,000
  b[0x1A] = 0x64;                                                  // max deceleration 100
  b[0x1E] = 0x40, b[0x1F] = 0x9C;                                  // max acceleration 40,000
  b[0x22] = 0xFE, b[0x23] = 0xFF, b[0x24] = 0xFF, b[0x25] = 0xFF;  // position -2
  b[0x26] = 0x80, b[0x27] = 0x7B, b[0x28] = 0xE1, b[0x29] = 0xFF;  // velocity -2,000,000
  b[0x33] = 0xE0, b[0x34] = 0x2E;                                  // 12000 mV
  b[0x49] = 3;                                                     // 1/8 step
  b[0x4A] = 46;
  b[0x4C] = 3;  // input state: position
  return b;
}

TEST(TicVariables, AreReadFromTheirOffsets) {
  const auto v = decode_variables(variable_bytes());
  ASSERT_TRUE(v.has_value()) << v.error().text();
  EXPECT_EQ(v->operation, Operation::soft_error);
  EXPECT_TRUE(v->energized);
  EXPECT_TRUE(v->position_uncertain);
  EXPECT_TRUE(v->forward_limit);
  EXPECT_FALSE(v->reverse_limit);
  EXPECT_TRUE(v->homing);
  EXPECT_EQ(v->error_status, error::command_timeout | error::safe_start);
  EXPECT_EQ(v->errors_occurred, error::low_vin | error::command_timeout | error::encoder_skip);
  EXPECT_EQ(v->planning, Planning::target_position);
  EXPECT_EQ(v->target_position, 1'234'567'890);
  EXPECT_EQ(v->target_velocity, -1);
  EXPECT_EQ(v->max_speed, 2'000'000U);
  EXPECT_EQ(v->max_decel, 100U);
  EXPECT_EQ(v->max_accel, 40'000U);
  EXPECT_EQ(v->position, -2);
  EXPECT_EQ(v->velocity, -2'000'000);
  EXPECT_EQ(v->vin_mv, 12000);
  EXPECT_EQ(v->step_mode, 3);
  EXPECT_EQ(v->current_limit, 46);
  EXPECT_FALSE(v->runs());
}

TEST(TicVariables, RunsFromStartingUpOn) {
  auto bytes = variable_bytes();
  for (const auto& [state, runs] :
       {std::pair{0, false}, {2, false}, {4, false}, {6, false}, {8, true}, {10, true}}) {
    bytes[0] = static_cast<std::uint8_t>(state);
    EXPECT_EQ(decode_variables(bytes)->runs(), runs) << state;
  }
}

TEST(TicVariables, WhatNoTicSaysIsDamaged) {
  struct Wrong {
    std::size_t at;
    std::uint8_t value;
  };
  for (const Wrong& wrong : {Wrong{0x00, 1}, Wrong{0x00, 12}, Wrong{0x09, 3}, Wrong{0x4C, 5}, Wrong{0x49, 10},
                             Wrong{0x19, 0xFF}, Wrong{0x29, 0x40}}) {
    auto bytes = variable_bytes();
    bytes[wrong.at] = wrong.value;
    const auto v = decode_variables(bytes);
    ASSERT_FALSE(v.has_value()) << wrong.at;
    EXPECT_EQ(v.error().code, ErrorCode::damaged) << wrong.at;
  }
  for (const std::size_t length : {0, 1, 0x54, 0x56}) {
    EXPECT_EQ(decode_variables(std::vector<std::uint8_t>(length)).error().code, ErrorCode::damaged) << length;
  }
  EXPECT_FALSE(decode_variables(std::vector<std::uint8_t>(0x55, 0xEE)).has_value());
}

TEST(TicVariables, ReservedBitsMayBeSet) {
  auto bytes = variable_bytes();
  bytes[0x01] |= 0xE0;
  bytes[0x03] = 0xFE;
  const auto v = decode_variables(bytes);
  ASSERT_TRUE(v.has_value());
  EXPECT_EQ(
      error_text(v->error_status & 0xFE00U),
      "error bit 9, error bit 10, error bit 11, error bit 12, error bit 13, error bit 14, error bit 15");
}

TEST(TicErrors, EachBitHasItsWords) {
  const std::vector<std::pair<unsigned, std::string>> names{{0, "intentionally de-energized"},
                                                            {1, "motor driver error"},
                                                            {2, "low VIN"},
                                                            {3, "kill switch active"},
                                                            {4, "required input invalid"},
                                                            {5, "serial error"},
                                                            {6, "command timeout"},
                                                            {7, "safe start violation"},
                                                            {8, "ERR line high"},
                                                            {16, "serial framing"},
                                                            {17, "serial RX overrun"},
                                                            {18, "serial format"},
                                                            {19, "serial CRC"},
                                                            {20, "encoder skip"}};
  for (const auto& [bit, name] : names) EXPECT_EQ(error_text(1U << bit), name);
  EXPECT_EQ(error_text(0), "");
  EXPECT_EQ(error_text(0x0C), "low VIN, kill switch active");
  // Not being energised and waiting to be resumed are states, not faults.
  EXPECT_EQ(error::faults, 0b1'0111'1110U);
}

TEST(TicSettings, AreReadFromTheirOffsets) {
  std::vector<std::uint8_t> b(0x69, 0);
  b[0x01] = 3;                  // RC speed
  b[0x02] = 0b0000'0010;        // automatic homing
  b[0x03] = 1;                  // safe start disabled
  b[0x09] = 0xE8, b[0x0A] = 3;  // 1000 ms
  b[0x40] = 46, b[0x41] = 5;
  b[0x53] = 3;  // go to position
  b[0x5F] = 8, b[0x60] = 4;
  b[0x61] = 0x40, b[0x62] = 0x42, b[0x63] = 0x0F;  // 1,000,000
  b[0x65] = 0x20, b[0x66] = 0xA1, b[0x67] = 0x07;  // 500,000
  const auto s = decode_settings(b);
  ASSERT_TRUE(s.has_value()) << s.error().text();
  EXPECT_EQ(s->control_mode, 3);
  EXPECT_TRUE(s->auto_homing);
  EXPECT_TRUE(s->disable_safe_start);
  EXPECT_EQ(s->command_timeout_ms, 1000);
  EXPECT_EQ(s->current_limit, 46);
  EXPECT_EQ(s->step_mode, 5);
  EXPECT_EQ(s->soft_error_response, SoftErrorResponse::go_to_position);
  EXPECT_EQ(s->forward_limit_pins, 8);
  EXPECT_EQ(s->reverse_limit_pins, 4);
  EXPECT_EQ(s->homing_speed_towards, 1'000'000U);
  EXPECT_EQ(s->homing_speed_away, 500'000U);

  auto wrong = b;
  wrong[0x01] = 8;
  EXPECT_EQ(decode_settings(wrong).error().code, ErrorCode::damaged);
  wrong = b;
  wrong[0x53] = 4;
  EXPECT_EQ(decode_settings(wrong).error().code, ErrorCode::damaged);
  wrong.pop_back();
  EXPECT_EQ(decode_settings(wrong).error().code, ErrorCode::damaged);
}

// Currents from the tables of the Tic's own tool.
TEST(TicProducts, CurrentsByCode) {
  EXPECT_EQ(current_ma(Product::t825, 6), 192);
  EXPECT_EQ(current_ma(Product::t825, 33), 1024) << "the driver rounds down";
  EXPECT_EQ(current_ma(Product::t825, 46), 1472);
  EXPECT_EQ(current_ma(Product::t825, 67), 2048);
  EXPECT_EQ(current_ma(Product::t825, 124), 3968);
  EXPECT_EQ(current_ma(Product::t825, 255), 3968);
  EXPECT_EQ(current_ma(Product::t834, 124), 3456);
  EXPECT_EQ(current_ma(Product::t500, 2), 174);
  EXPECT_EQ(current_ma(Product::t500, 32), 3093);
  EXPECT_EQ(current_ma(Product::t249, 112), 4480);
  EXPECT_EQ(current_ma(Product::v36, 1), 72);
  EXPECT_EQ(current_ma(Product::v36, 127), 9095);
}

TEST(TicProducts, TheCodeIsTheGreatestNotAboveTheCurrent) {
  EXPECT_EQ(current_code(Product::t825, 1500), 46);
  EXPECT_EQ(current_code(Product::t825, 1472), 46);
  EXPECT_EQ(current_code(Product::t825, 1471), 44);
  EXPECT_EQ(current_code(Product::t825, 31), 0);
  EXPECT_EQ(current_code(Product::t825, 99999), 124);
  EXPECT_EQ(current_code(Product::t500, 500), 4);
  for (const Product p :
       {Product::t825, Product::t834, Product::t500, Product::n825, Product::t249, Product::v36}) {
    for (int ma = 0; ma <= most_current_ma(p); ++ma) {
      const int got = current_ma(p, current_code(p, ma));
      ASSERT_LE(got, ma) << name_of(p);
      // No code sets a current between the two.
      for (int code = 0; code < 128; ++code) {
        const int other = current_ma(p, static_cast<std::uint8_t>(code));
        ASSERT_FALSE(other > got && other <= ma) << name_of(p) << ' ' << ma;
      }
    }
  }
}

TEST(TicProducts, StepModes) {
  EXPECT_EQ(step_mode_code(Product::t825, 1), 0);
  EXPECT_EQ(step_mode_code(Product::t825, 2), 1);
  EXPECT_EQ(step_mode_code(Product::t825, 32), 5);
  EXPECT_EQ(step_mode_code(Product::t825, 64), std::nullopt);
  EXPECT_EQ(step_mode_code(Product::t500, 16), std::nullopt);
  EXPECT_EQ(step_mode_code(Product::v36, 64), 7);
  EXPECT_EQ(step_mode_code(Product::v36, 256), 9);
  EXPECT_EQ(microsteps(6), 2) << "half steps at full current";
  EXPECT_EQ(microsteps(9), 256);
  EXPECT_EQ(microsteps(10), std::nullopt);
}

TEST(TicProducts, AreKnownByTheirNumbers) {
  EXPECT_EQ(product_of(0x00B3), Product::t825);
  EXPECT_EQ(product_of(0x00CB), Product::v36);
  EXPECT_EQ(product_of(0x00B4), std::nullopt) << "a bootloader, say";
}

}  // namespace
}  // namespace rig::drivers::tic
