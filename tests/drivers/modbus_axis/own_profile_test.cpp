// A drive of nobody's make, unlike those that come with the program, needs a description and no code.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mutex>
#include <thread>

#include "core/base/units.h"
#include "sim/wire/modbus_line.h"
#include "sim/wire/motor.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/modbus_axis/opened_module.h"

namespace rig::drivers::modbus {
namespace {

using base::ErrorCode;
using base::radians;
using std::chrono::milliseconds;

// Low word first; state and position in input registers, as half counts; speeds as time for a degree's 1000
// counts; a status number instead of bits; no running bit, no homed bit; one command at a time.
class OddDrive final : public sim::wire::ModbusRegisters {
 public:
  std::optional<Words> read(bool input, std::uint16_t address, std::size_t count) override {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (!input || address + count > 5) return std::nullopt;
    const auto half_counts = static_cast<std::uint32_t>(static_cast<std::int32_t>(2 * motor_.position(now)));
    // 1 ready, 2 working, 9 broken.
    const std::uint16_t word = broken_ ? 9 : motor_.moving(now) ? 2 : 1;
    const Words all{word, static_cast<std::uint16_t>(half_counts & 0xFFFF),
                    static_cast<std::uint16_t>(half_counts >> 16), 17, on_};
    return Words(all.begin() + address, all.begin() + address + static_cast<std::ptrdiff_t>(count));
  }

  std::optional<sim::wire::ModbusException> write(std::uint16_t address, const Words& words) override {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (address == 100 && words.size() == 4) {
      if (motor_.moving(now)) return sim::wire::ModbusException::device_failure;
      const auto target = static_cast<std::int32_t>(static_cast<std::uint32_t>(words[1]) << 16 | words[0]);
      const double us_per_count = words[2] / 1000.0;
      motor_.move_to(now, target, 1e6 / us_per_count, words[3] * 1000.0);
      return std::nullopt;
    }
    if (address == 110 && words == Words{1}) {
      motor_.stop(now, 1e6);
      return std::nullopt;
    }
    if (address == 111 && words == Words{1}) {
      motor_.move_to(now, 0, 20000, 1e5);
      return std::nullopt;
    }
    if (address == 112 && words.size() == 1 && words[0] <= 1) {
      on_ = words[0];
      return std::nullopt;
    }
    return sim::wire::ModbusException::illegal_address;
  }

  void break_down() {
    const std::lock_guard lock(mutex_);
    broken_ = true;
    motor_.stop(std::chrono::steady_clock::now(), 1e7);
  }

 private:
  std::mutex mutex_;
  sim::wire::Motor motor_{3000, {-50000, 50000}};
  std::uint16_t on_ = 0;
  bool broken_ = false;
};

constexpr const char* kDescription = R"(
format = 1
name = "an odd drive"
[line]
baud = 19200
parity = "odd"
stop_bits = 2
gap_ms = 4
word_order = "low_first"
one_word = "multiple"
[register.status]
address = 0
table = "input"
[register.position]
address = 1
table = "input"
type = "i32"
scale = 0.5
[register.alarm]
address = 3
table = "input"
[register.on]
address = 4
table = "input"
[state]
position = "position"
fault = "status == 9"
enabled = "on == 1"
complete = "status != 2"
homed = "remembered"
alarm = "alarm"
[alarm]
17 = "the belt has torn"
[value.target]
of = "position"
[value.ns_per_count]
of = "velocity"
inverse = true
scale = 1e9
high = 65535
[value.kilocounts]
of = "acceleration"
scale = 0.001
[sequence]
enable = ["112 = 1"]
disable = ["112 = 0"]
home = ["111 = 1"]
move = ["100 = {target} {ns_per_count} {kilocounts}"]
stop = ["110 = 1"]
[motion]
take_ms = 60
finish_ms = 200
while_moving = "refuse"
)";

class OwnProfile : public testing::Test {
 protected:
  void SetUp() override {
    test::put_bytes(folder_ / "odd.toml", kDescription);
    line_ = sim::wire::make_rtu_line(folder_ / "line", std::chrono::microseconds(1750), {{9, &drive_}});
    auto devices = open_module(
        fmt::format("port = \"{}\"\nprofile = \"{}\"\nanswer_ms = 150\n{}", (folder_ / "line").string(),
                    (folder_ / "odd.toml").string(), axis_settings("pan", 9)),
        *clock_);
    ASSERT_TRUE(devices.has_value()) << devices.error().text();
    devices_ = std::move(*devices);
  }
  Axis& axis() { return axis_of(devices_.front()); }
  AxisState state() {
    const auto now = axis().state();
    EXPECT_TRUE(now.has_value()) << now.error().text();
    return now.value_or(AxisState{});
  }
  AxisState at_rest() {
    AxisState now;
    for (int i = 0; i < 500; ++i) {
      now = state();
      if (!now.moving) return now;
      std::this_thread::sleep_for(milliseconds(5));
    }
    ADD_FAILURE() << "it still moves";
    return now;
  }
  void home() {
    ASSERT_TRUE(axis().enable(true).has_value());
    ASSERT_TRUE(axis().home().has_value());
    EXPECT_TRUE(at_rest().homed);
  }

  const test::TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  OddDrive drive_;
  std::unique_ptr<sim::wire::ModbusLine> line_;
  std::vector<Device> devices_;
};

TEST_F(OwnProfile, HomesAndMoves) {
  const AxisState first = at_rest();
  EXPECT_FALSE(first.homed);
  EXPECT_FALSE(first.enabled);
  EXPECT_NEAR(first.position_rad, radians(3), 1e-9);
  home();
  EXPECT_NEAR(state().position_rad, 0, 1e-9);
  ASSERT_TRUE(axis().move_to(radians(-8), radians(60), radians(300)).has_value());
  EXPECT_NEAR(at_rest().position_rad, radians(-8), radians(0.001));
}

TEST_F(OwnProfile, TakesOneCommandAtATime) {
  home();
  ASSERT_TRUE(axis().move_to(radians(30), radians(30), radians(300)).has_value());
  const auto second = axis().move_to(radians(5), radians(30), radians(300));
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::busy);
  ASSERT_TRUE(axis().stop().has_value());
  EXPECT_LT(at_rest().position_rad, radians(29));
  ASSERT_TRUE(axis().move_to(radians(1), radians(60), radians(300)).has_value());
  EXPECT_NEAR(at_rest().position_rad, radians(1), radians(0.001));
}

TEST_F(OwnProfile, ItsHomingIsRememberedOnlyWhileItIsThere) {
  home();
  line_->cut();
  EXPECT_EQ(axis().state().error().code, ErrorCode::lost);
  line_->restore();
  for (int i = 0; i < 300 && !axis().state(); ++i) std::this_thread::sleep_for(milliseconds(20));
  EXPECT_FALSE(at_rest().homed);
  const auto moved = axis().move_to(radians(1), radians(60), radians(300));
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, ErrorCode::refused);
}

TEST_F(OwnProfile, ItsAlarmIsNamedAndEndsWhatWasRemembered) {
  home();
  drive_.break_down();
  const AxisState now = state();
  EXPECT_EQ(now.fault, "alarm 0x11: the belt has torn");
  EXPECT_FALSE(now.homed);
}

}  // namespace
}  // namespace rig::drivers::modbus
