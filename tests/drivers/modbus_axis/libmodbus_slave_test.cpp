// Against a slave that nobody here wrote: Debian's libmodbus with its register mapping, over a pair of
// pseudo-terminals and over TCP.
#include <array>
#include <atomic>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <modbus.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include "drivers/modbus_axis/bus.h"
#include "sim/wire/pty.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::modbus {
namespace {

using base::ErrorCode;
using sim::wire::Pty;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kSlave = 17;
constexpr std::uint16_t kFirst = 0x0100, kCount = 64;

struct Free {
  void operator()(modbus_t* context) const { modbus_free(context); }
  void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
};
using Context = std::unique_ptr<modbus_t, Free>;

// Two terminals; what is written at the one is to be read at the other.
class PtyPair {
 public:
  ~PtyPair() {
    goes_on_ = false;
    there_.join();
    back_.join();
  }
  [[nodiscard]] std::string ours() const { return ours_.path().string(); }
  [[nodiscard]] std::string theirs() const { return theirs_.path().string(); }

 private:
  void carry(Pty& from, Pty& to) {
    while (goes_on_) {
      const std::string bytes = from.read(milliseconds(20));
      if (!bytes.empty()) to.write(bytes);
    }
  }

  const test::TemporaryFolder folder_;
  Pty ours_{folder_ / "ours"}, theirs_{folder_ / "theirs"};
  std::atomic<bool> goes_on_ = true;
  std::thread there_{[this] { carry(ours_, theirs_); }}, back_{[this] { carry(theirs_, ours_); }};
};

// Answers with libmodbus from a mapping of holding and input registers. The mapping is the test's to look at
// between two requests.
class Slave {
 public:
  Slave(Context context, bool tcp) : context_(std::move(context)) {
    EXPECT_NE(mapping_, nullptr);
    modbus_set_slave(context_.get(), kSlave);
    modbus_set_indication_timeout(context_.get(), 0, 20000);
    if (tcp) {
      listener_ = modbus_tcp_listen(context_.get(), 1);
      EXPECT_GE(listener_, 0) << modbus_strerror(errno);
    } else {
      EXPECT_EQ(modbus_connect(context_.get()), 0) << modbus_strerror(errno);
    }
    thread_ = std::thread([this] { serve(); });
  }
  ~Slave() {
    goes_on_ = false;
    // Ends a wait for a client that never came.
    if (listener_ >= 0) ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    modbus_close(context_.get());
    if (listener_ >= 0) ::close(listener_);
  }
  Slave(const Slave&) = delete;
  Slave& operator=(const Slave&) = delete;

  [[nodiscard]] std::uint16_t& holding(std::uint16_t address) {
    return mapping_->tab_registers[address - kFirst];
  }
  [[nodiscard]] std::uint16_t& input(std::uint16_t address) {
    return mapping_->tab_input_registers[address - kFirst];
  }
  [[nodiscard]] int port() const {
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    return ntohs(address.sin_port);
  }

 private:
  void serve() {
    if (listener_ >= 0 && modbus_tcp_accept(context_.get(), &listener_) < 0) return;
    std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> request{};
    while (goes_on_) {
      const int size = modbus_receive(context_.get(), request.data());
      if (size > 0) modbus_reply(context_.get(), request.data(), size, mapping_.get());
    }
  }

  const Context context_;
  const std::unique_ptr<modbus_mapping_t, Free> mapping_{
      modbus_mapping_new_start_address(0, 0, 0, 0, kFirst, kCount, kFirst, kCount)};
  int listener_ = -1;
  std::atomic<bool> goes_on_ = true;
  std::thread thread_;
};

class Libmodbus : public testing::TestWithParam<bool> {
 protected:
  Libmodbus() {
    WireSettings settings;
    settings.answer = kAnswer;
    if (GetParam()) {
      slave_ = std::make_unique<Slave>(Context(modbus_new_tcp("127.0.0.1", 0)), true);
      settings.host = "127.0.0.1";
      settings.tcp_port = slave_->port();
    } else {
      pair_ = std::make_unique<PtyPair>();
      slave_ =
          std::make_unique<Slave>(Context(modbus_new_rtu(pair_->theirs().c_str(), 38400, 'N', 8, 1)), false);
      settings.serial.path = pair_->ours();
      settings.serial.baud = 38400;
      settings.gap = silent_interval(38400);
    }
    bus_ = std::make_unique<Bus>(settings, RetryPolicy{3, kAnswer}, *clock_);
  }

  static constexpr milliseconds kAnswer{300};
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::unique_ptr<PtyPair> pair_;
  std::unique_ptr<Slave> slave_;
  std::unique_ptr<Bus> bus_;
  Peer peer_{kSlave, true, {{Table::holding, kFirst, 1}, {Table::holding, kFirst, 2}}};
};

INSTANTIATE_TEST_SUITE_P(Wires, Libmodbus, testing::Bool(),
                         [](const auto& wire) { return wire.param ? "Tcp" : "Pty"; });

TEST_P(Libmodbus, WhatIsWrittenIsWhatItHoldsAndWhatIsRead) {
  // One word with function 06, then several with 16, then one with 16.
  ASSERT_TRUE(bus_->write(peer_, {0x0102, {0xBEEF}}).has_value());
  EXPECT_EQ(slave_->holding(0x0102), 0xBEEF);
  ASSERT_TRUE(bus_->write(peer_, {0x0103, {0x0001, 0x86A0, 0xFFFF}}).has_value());
  EXPECT_EQ(slave_->holding(0x0103), 0x0001);
  EXPECT_EQ(slave_->holding(0x0105), 0xFFFF);
  peer_.one_word_single = false;
  ASSERT_TRUE(bus_->write(peer_, {0x0106, {0x1234}}).has_value());
  const auto words = bus_->read(peer_, {Table::holding, 0x0102, 5});
  ASSERT_TRUE(words.has_value()) << words.error().text();
  EXPECT_THAT(*words, ElementsAre(0xBEEF, 0x0001, 0x86A0, 0xFFFF, 0x1234));
}

TEST_P(Libmodbus, ItsTwoTablesAreTwo) {
  slave_->holding(0x0110) = 1;
  slave_->input(0x0110) = 2;
  const auto holding = bus_->read(peer_, {Table::holding, 0x0110, 1});
  const auto input = bus_->read(peer_, {Table::input, 0x0110, 1});
  ASSERT_TRUE(holding.has_value() && input.has_value());
  EXPECT_THAT(*holding, ElementsAre(1));
  EXPECT_THAT(*input, ElementsAre(2));
}

TEST_P(Libmodbus, RefusesRegistersThatItDoesNotHave) {
  for (const std::uint16_t address : {std::uint16_t{0x00FF}, std::uint16_t{kFirst + kCount}}) {
    const auto words = bus_->read(peer_, {Table::holding, address, 1});
    ASSERT_FALSE(words.has_value());
    EXPECT_EQ(words.error().code, ErrorCode::device);
    EXPECT_THAT(words.error().text(), HasSubstr("Illegal data address"));
    const auto done = bus_->write(peer_, {address, {1, 2}});
    ASSERT_FALSE(done.has_value());
    EXPECT_EQ(done.error().code, ErrorCode::device);
  }
  // Across its end.
  EXPECT_FALSE(bus_->read(peer_, {Table::holding, kFirst + kCount - 1, 2}).has_value());
  EXPECT_TRUE(bus_->read(peer_, {Table::holding, kFirst + kCount - 1, 1}).has_value());
}

TEST_P(Libmodbus, AHundredRoundTripsStayInStep) {
  for (std::uint16_t i = 0; i < 100; ++i) {
    const auto address = static_cast<std::uint16_t>(kFirst + i % (kCount - 1));
    ASSERT_TRUE(bus_->write(peer_, {address, {i, static_cast<std::uint16_t>(~i)}}).has_value());
    const auto words = bus_->read(peer_, {Table::holding, address, 2});
    ASSERT_TRUE(words.has_value()) << words.error().text();
    ASSERT_THAT(*words, ElementsAre(i, static_cast<std::uint16_t>(~i)));
  }
}

// Over TCP libmodbus answers whatever slave is asked for.
TEST(LibmodbusSlave, AnotherSlavesNumberIsNotAnswered) {
  PtyPair pair;
  const Slave slave(Context(modbus_new_rtu(pair.theirs().c_str(), 38400, 'N', 8, 1)), false);
  const auto clock = base::make_system_clock();
  WireSettings settings;
  settings.serial.path = pair.ours();
  settings.serial.baud = 38400;
  settings.gap = silent_interval(38400);
  settings.answer = milliseconds(50);
  Bus bus(settings, {3, settings.answer}, *clock);
  Peer peer{kSlave + 1, true, {{Table::holding, kFirst, 1}}};
  const auto words = bus.read(peer, {Table::holding, kFirst, 1});
  ASSERT_FALSE(words.has_value());
  EXPECT_EQ(words.error().code, ErrorCode::lost);
}

}  // namespace
}  // namespace rig::drivers::modbus
