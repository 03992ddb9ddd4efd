// The slaves of the tests speak the protocol as its makers print it; and so does the driver, byte for byte.
// The frames are those of the manuals of Leadshine's iEM-RS and CS2RS drives.
#include <array>
#include <fcntl.h>
#include <fmt/format.h>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <thread>
#include <unistd.h>

#include "drivers/modbus_axis/wire.h"
#include "sim/wire/modbus_frame.h"
#include "sim/wire/modbus_leadshine.h"
#include "sim/wire/modbus_line.h"
#include "sim/wire/pty.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/babble.h"

namespace rig::drivers::modbus {
namespace {

using base::ErrorCode;
using sim::wire::LeadshineDrive;
using sim::wire::Pty;
using std::chrono::milliseconds;
using testing::ElementsAre;

std::string bytes(const std::string& hex) {
  std::string out;
  for (std::size_t at = 0; at + 1 < hex.size(); at += 3) {
    out += static_cast<char>(std::stoi(hex.substr(at, 2), nullptr, 16));
  }
  return out;
}

std::string hex(const std::string& raw) {
  std::string out;
  for (const char c : raw)
    out += fmt::format("{}{:02X}", out.empty() ? "" : " ", static_cast<unsigned char>(c));
  return out;
}

constexpr std::array kFrames{
    "07 10 62 00 00 08 10 00 01 00 00 27 10 00 00 27 10 27 10 00 00 00 10 8D 50",
    "07 10 62 00 00 08 DE 11",
    "01 06 18 01 22 11 06 06",
    "01 83 08 40 F6",
    "01 82 01 81 60",
    "01 03 0F 00 00 0A C6 D9",
    "01 10 0F 10 00 0A 42 DF",
};

TEST(Frames, CarryTheChecksumOfTheManuals) {
  for (const char* frame : kFrames) {
    const std::string raw = bytes(frame);
    EXPECT_EQ(hex(sim::wire::with_modbus_crc(raw.substr(0, raw.size() - 2))), frame);
    EXPECT_TRUE(sim::wire::modbus_crc_fits(raw)) << frame;
    for (std::size_t at = 0; at < raw.size(); ++at) {
      std::string broken = raw;
      broken[at] = static_cast<char>(broken[at] ^ 0x10);
      EXPECT_FALSE(sim::wire::modbus_crc_fits(broken)) << frame << " at " << at;
    }
  }
}

class RawLine : public testing::Test {
 protected:
  [[nodiscard]] WireSettings settings() const {
    WireSettings made;
    made.serial.path = (folder_ / "line").string();
    made.serial.baud = 38400;
    made.answer = milliseconds(500);
    made.gap = silent_interval(38400);
    return made;
  }
  std::unique_ptr<Wire> open() {
    auto wire = Wire::open(settings());
    EXPECT_TRUE(wire.has_value()) << wire.error().text();
    return std::move(*wire);
  }
  // What the driver sent, once so many bytes are there.
  std::string sent(std::size_t size) {
    std::string got;
    for (int i = 0; i < 200 && got.size() < size; ++i) got += pty_.read(milliseconds(20));
    return hex(got);
  }

  const test::TemporaryFolder folder_;
  Pty pty_{folder_ / "line"};
};

TEST_F(RawLine, TheDriverWritesSeveralWordsAsTheManualDoes) {
  const auto wire = open();
  auto done = std::async(std::launch::async, [&] {
    return wire->write(7, {0x6200, {0x0001, 0x0000, 0x2710, 0x0000, 0x2710, 0x2710, 0x0000, 0x0010}}, true);
  });
  EXPECT_EQ(sent(25), kFrames[0]);
  pty_.write(bytes(kFrames[1]));
  const auto outcome = done.get();
  EXPECT_TRUE(outcome.has_value()) << outcome.error().text();
}

TEST_F(RawLine, TheDriverWritesASingleWordAsTheManualDoes) {
  const auto wire = open();
  auto done = std::async(std::launch::async, [&] { return wire->write(1, {0x1801, {0x2211}}, true); });
  EXPECT_EQ(sent(8), kFrames[2]);
  pty_.write(bytes(kFrames[2]));
  EXPECT_TRUE(done.get().has_value());
}

TEST_F(RawLine, TheDriverReadsAsTheManualDoes) {
  const auto wire = open();
  auto done = std::async(std::launch::async, [&] { return wire->read(1, {Table::holding, 0x0F00, 10}); });
  EXPECT_EQ(sent(8), kFrames[5]);
  pty_.write(sim::wire::with_modbus_crc(
      bytes("01 03 14 27 10 05 87 00 0F 00 3C 00 FA 00 03 0F A0 00 5A 00 01 00 00 ")));
  const auto words = done.get();
  ASSERT_TRUE(words.has_value()) << words.error().text();
  EXPECT_THAT(*words, ElementsAre(0x2710, 0x0587, 0x000F, 0x003C, 0x00FA, 0x0003, 0x0FA0, 0x005A, 1, 0));
}

ErrorCode read_error(Wire& wire, Pty& pty, const std::string& answer) {
  auto done = std::async(std::launch::async, [&] { return wire.read(1, {Table::holding, 0x0001, 1}); });
  for (int i = 0; i < 200 && pty.read(milliseconds(20)).empty(); ++i) {
  }
  pty.write(answer);
  const auto words = done.get();
  EXPECT_FALSE(words.has_value());
  return words ? ErrorCode::io : words.error().code;
}

TEST_F(RawLine, AnswersThatAreNoneAreToldApart) {
  const auto wire = open();
  const auto frame = [](const std::string& text) { return sim::wire::with_modbus_crc(bytes(text)); };
  // Right: then wrong checksum, another slave's, another function's, another length, nothing at all.
  EXPECT_EQ(read_error(*wire, pty_, bytes("01 03 02 27 10 00 00 ")), ErrorCode::damaged);
  EXPECT_EQ(read_error(*wire, pty_, frame("02 03 02 27 10 ")), ErrorCode::damaged);
  EXPECT_EQ(read_error(*wire, pty_, frame("01 04 02 27 10 ")), ErrorCode::damaged);
  EXPECT_EQ(read_error(*wire, pty_, frame("01 03 04 27 10 00 00 ")), ErrorCode::damaged);
  EXPECT_EQ(read_error(*wire, pty_, ""), ErrorCode::timeout);
  EXPECT_EQ(read_error(*wire, pty_, "\x01\x03"), ErrorCode::timeout);
  // Exceptions: illegal address; busy; Leadshine's "your checksum is wrong"; one that there is not.
  EXPECT_EQ(read_error(*wire, pty_, frame("01 83 02 ")), ErrorCode::device);
  EXPECT_EQ(read_error(*wire, pty_, frame("01 83 06 ")), ErrorCode::damaged);
  EXPECT_EQ(read_error(*wire, pty_, bytes(kFrames[3])), ErrorCode::damaged);
  EXPECT_EQ(read_error(*wire, pty_, frame("01 83 63 ")), ErrorCode::damaged);
}

TEST_F(RawLine, WhatCameUncalledForIsDropped) {
  const auto wire = open();
  pty_.write(sim::wire::with_modbus_crc(bytes("01 03 02 00 63 ")));
  auto done = std::async(std::launch::async, [&] { return wire->read(1, {Table::holding, 0x0001, 1}); });
  EXPECT_EQ(sent(8), hex(sim::wire::with_modbus_crc(bytes("01 03 00 01 00 01 "))));
  pty_.write(sim::wire::with_modbus_crc(bytes("01 03 02 00 07 ")));
  const auto words = done.get();
  ASSERT_TRUE(words.has_value()) << words.error().text();
  EXPECT_THAT(*words, ElementsAre(7));
}

TEST_F(RawLine, ALineThatIsNeverSilentIsAnError) {
  const auto wire = open();
  const test::Babble babble(pty_);
  const auto words = wire->read(1, {Table::holding, 0x0001, 1});
  ASSERT_FALSE(words.has_value());
  EXPECT_EQ(words.error().code, ErrorCode::damaged);
}

TEST_F(RawLine, AStopIsSentIntoTheNoise) {
  const auto wire = open();
  const test::Babble babble(pty_);
  const auto began = std::chrono::steady_clock::now();
  auto done = std::async(std::launch::async, [&] {
    return wire->write_at_once(1, {0x1801, {0x2211}}, true);
  });
  EXPECT_EQ(sent(8), kFrames[2]);
  EXPECT_LT(std::chrono::steady_clock::now() - began, milliseconds(250));
  // Whether it arrived is not known.
  EXPECT_FALSE(done.get().has_value());
}

TEST_F(RawLine, ACallThatIsOverSendsNothingButAStop) {
  const auto wire = open();
  const Deadline over = std::chrono::steady_clock::now();
  EXPECT_FALSE(wire->read(1, {Table::holding, 0x0001, 1}, over).has_value());
  EXPECT_FALSE(wire->write(1, {0x1801, {0x2211}}, true, over).has_value());
  EXPECT_EQ(pty_.read(milliseconds(20)), "");
  EXPECT_FALSE(wire->write_at_once(1, {0x1801, {0x2211}}, true, over).has_value());
  EXPECT_EQ(sent(8), kFrames[2]);
}

TEST_F(RawLine, IsOneProgramsAlone) {
  const auto wire = open();
  const auto second = Wire::open(settings());
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::busy);
}

TEST_F(RawLine, ThatIsGoneIsLost) {
  const auto wire = open();
  pty_.cut();
  const auto words = wire->read(1, {Table::holding, 0x0001, 1});
  ASSERT_FALSE(words.has_value());
  EXPECT_EQ(words.error().code, ErrorCode::lost);
  const auto again = Wire::open(settings());
  ASSERT_FALSE(again.has_value());
  EXPECT_EQ(again.error().code, ErrorCode::lost);
}

TEST(WireFiles, ThatAreNoSerialLineAreAnError) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "file", "");
  WireSettings settings;
  settings.serial.path = (folder / "file").string();
  settings.serial.baud = 38400;
  const auto wire = Wire::open(settings);
  ASSERT_FALSE(wire.has_value());
}

// The slave as a master sees it that sends what it likes.
class Slave : public testing::Test {
 protected:
  std::string answer(const std::string& request) {
    const int fd = ::open((folder_ / "line").c_str(), O_RDWR | O_NOCTTY);
    EXPECT_GE(fd, 0);
    EXPECT_EQ(::write(fd, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    std::string got;
    pollfd wait{fd, POLLIN, 0};
    while (::poll(&wait, 1, 100) > 0) {
      std::array<char, 300> buffer{};
      const ssize_t n = ::read(fd, buffer.data(), buffer.size());
      if (n <= 0) break;
      got.append(buffer.data(), static_cast<std::size_t>(n));
    }
    ::close(fd);
    return hex(got);
  }

  const test::TemporaryFolder folder_;
  LeadshineDrive drive_{{}};
  const std::unique_ptr<sim::wire::ModbusLine> line_ =
      sim::wire::make_rtu_line(folder_ / "line", std::chrono::microseconds(1750), {{1, &drive_}});
};

TEST_F(Slave, AnswersAsTheManualSays) {
  // Wrong checksum: the exception of these drives. Wrong function; read of a register that there is not.
  EXPECT_EQ(answer(bytes("01 03 00 01 00 01 D5 C1")), kFrames[3]);
  EXPECT_EQ(answer(sim::wire::with_modbus_crc(bytes("01 02 00 01 00 01 "))), kFrames[4]);
  EXPECT_EQ(answer(sim::wire::with_modbus_crc(bytes("01 03 00 02 00 01 "))),
            hex(sim::wire::with_modbus_crc(bytes("01 83 02 "))));
  EXPECT_EQ(answer(sim::wire::with_modbus_crc(bytes("01 03 00 01 00 01 "))),
            hex(sim::wire::with_modbus_crc(bytes("01 03 02 27 10 "))));
}

TEST_F(Slave, HearsOnlyWhatIsMeantForIt) {
  EXPECT_EQ(answer(sim::wire::with_modbus_crc(bytes("02 03 00 01 00 01 "))), "");
  EXPECT_EQ(answer(bytes("01 03")), "");
}

TEST_F(Slave, NeedsSilenceBeforeARequest) {
  const std::string request = sim::wire::with_modbus_crc(bytes("01 03 00 01 00 01 "));
  const int before = line_->unreadable();
  // The second begins as soon as the first has been answered.
  const int fd = ::open((folder_ / "line").c_str(), O_RDWR | O_NOCTTY);
  std::array<char, 300> buffer{};
  ASSERT_EQ(::write(fd, request.data(), request.size()), 8);
  pollfd wait{fd, POLLIN, 0};
  ASSERT_GT(::poll(&wait, 1, 2000), 0);
  int missed = 0;
  for (int i = 0; i < 50 && missed == 0; ++i) {
    (void)::read(fd, buffer.data(), buffer.size());
    ASSERT_EQ(::write(fd, request.data(), request.size()), 8);
    missed = ::poll(&wait, 1, 200) == 0 ? 1 : 0;
  }
  ::close(fd);
  EXPECT_EQ(missed, 1);
  EXPECT_GT(line_->unreadable(), before);
}

}  // namespace
}  // namespace rig::drivers::modbus
