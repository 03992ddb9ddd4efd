// The simulated node and bus are as strict as the documents: only then do they prove anything.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "drivers/cia402_axis/can_bus.h"
#include "sim/wire/can_hub.h"
#include "sim/wire/canopen_console.h"
#include "tests/drivers/cia402_axis/frames.h"
#include "tests/drivers/cia402_axis/rig.h"

namespace rig::drivers::cia402 {
namespace {

using sim::wire::CanHub;
using sim::wire::CanopenNode;
using sim::wire::CanopenStation;
using std::chrono::milliseconds;
using testing::HasSubstr;

// A node in made-up time: a millisecond passes with each step.
class Node {
 public:
  explicit Node(CanopenNode::Settings settings = quick_node(1)) : node_(settings) {
    node_.power_on(now_);
    pass(40);
  }

  CanopenNode& operator*() { return node_; }
  CanopenNode* operator->() { return &node_; }
  /// What it sends within so many milliseconds.
  std::vector<can_frame> pass(int steps) {
    std::vector<can_frame> sent;
    for (int i = 0; i < steps; ++i) {
      now_ += milliseconds(1);
      for (const can_frame& frame : node_.tick(now_)) sent.push_back(frame);
    }
    all_.insert(all_.end(), sent.begin(), sent.end());
    return sent;
  }
  /// The answer of its server to a request; none: an empty frame.
  can_frame ask(std::initializer_list<int> bytes) {
    node_.receive(now_, frame_of(0x601, bytes));
    for (const can_frame& frame : pass(3)) {
      if (frame.can_id == 0x581) return frame;
    }
    return {};
  }
  void receive(const can_frame& frame) { node_.receive(now_, frame); }
  void start() { receive(frame_of(0x000, {0x01, 0x01})); }
  void control(int word) {
    EXPECT_EQ(ask({0x2B, 0x40, 0x60, 0, word & 0xFF, word >> 8, 0, 0}),
              frame_of(0x581, {0x60, 0x40, 0x60, 0, 0, 0, 0, 0}));
    pass(20);
  }
  int state() { return node_.drive().statusword() & 0x6F; }
  const std::vector<can_frame>& all() const { return all_; }

 private:
  CanopenNode node_;
  CanopenNode::Time now_ = CanopenNode::Time{} + std::chrono::hours(1);
  std::vector<can_frame> all_;
};

TEST(WireNode, BootsThenWaitsPreOperational) {
  Node node;
  ASSERT_EQ(node.all().size(), 1U);
  EXPECT_EQ(node.all()[0], frame_of(0x701, {0x00}));
  EXPECT_EQ(node->nmt_state(), 0x7F);
  node.receive(frame_of(0x000, {0x01, 0x02}));  // another node
  EXPECT_EQ(node->nmt_state(), 0x7F);
  node.receive(frame_of(0x000, {0x01, 0x00}));  // all
  EXPECT_EQ(node->nmt_state(), 0x05);
}

TEST(WireNode, SendsHeartbeatsOnceItIsTold) {
  Node node;
  EXPECT_TRUE(node.pass(500).empty());
  (void)node.ask({0x2B, 0x17, 0x10, 0, 100, 0, 0, 0});
  int beats = 0;
  for (const can_frame& frame : node.pass(500)) beats += frame == frame_of(0x701, {0x7F}) ? 1 : 0;
  EXPECT_NEAR(beats, 5, 1);
}

TEST(WireNode, RefusesWhatCiA301Refuses) {
  Node node;
  EXPECT_EQ(node.ask({0x40, 0x45, 0x23, 0, 0, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x45, 0x23, 0, 0x00, 0x00, 0x02, 0x06}));
  EXPECT_EQ(node.ask({0x40, 0x99, 0x60, 9, 0, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x99, 0x60, 9, 0x11, 0x00, 0x09, 0x06}));
  EXPECT_EQ(node.ask({0x2B, 0x41, 0x60, 0, 0, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x41, 0x60, 0, 0x02, 0x00, 0x01, 0x06}));
  EXPECT_EQ(node.ask({0x23, 0x40, 0x60, 0, 6, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x40, 0x60, 0, 0x12, 0x00, 0x07, 0x06}));
  EXPECT_EQ(node.ask({0x2F, 0x40, 0x60, 0, 6, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x40, 0x60, 0, 0x13, 0x00, 0x07, 0x06}));
  EXPECT_EQ(node.ask({0x2F, 0x60, 0x60, 0, 3, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x60, 0x60, 0, 0x30, 0x00, 0x09, 0x06}));
  EXPECT_EQ(node.ask({0xE0, 0, 0, 0, 0, 0, 0, 0}), frame_of(0x581, {0x80, 0, 0, 0, 0x01, 0x00, 0x04, 0x05}));
  EXPECT_EQ(node.ask({0x40, 0x41, 0x60}).can_dlc, 0);  // too short: no question
}

TEST(WireNode, ItsNameComesInSegmentsWithTheToggleBitWatched) {
  Node node;
  EXPECT_EQ(node.ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}), frame_of(0x581, {0x41, 0x08, 0x10, 0, 20, 0, 0, 0}));
  EXPECT_EQ(node.ask({0x60, 0, 0, 0, 0, 0, 0, 0}),
            frame_of(0x581, {0x00, 'r', 'i', 'g', 'd', ' ', 's', 'i'}));
  EXPECT_EQ(node.ask({0x60, 0, 0, 0, 0, 0, 0, 0}),
            frame_of(0x581, {0x80, 0x08, 0x10, 0, 0x00, 0x00, 0x03, 0x05}));
  (void)node.ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  (void)node.ask({0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(node.ask({0x70, 0, 0, 0, 0, 0, 0, 0}),
            frame_of(0x581, {0x10, 'm', 'u', 'l', 'a', 't', 'e', 'd'}));
  EXPECT_EQ(node.ask({0x60, 0, 0, 0, 0, 0, 0, 0}), frame_of(0x581, {0x03, ' ', 'd', 'r', 'i', 'v', 'e', 0}));
  EXPECT_EQ(node.ask({0x70, 0, 0, 0, 0, 0, 0, 0}).data[0], 0x80);  // it is over
}

TEST(WireNode, APdoIsMappedInOrderOrNotAtAll) {
  Node node;
  EXPECT_EQ(node.ask({0x2F, 0x00, 0x16, 0, 0, 0, 0, 0}).data[0], 0x80);  // the PDO is still on
  EXPECT_EQ(node.ask({0x23, 0x00, 0x14, 1, 0x01, 0x02, 0, 0x80}).data[0], 0x60);
  EXPECT_EQ(node.ask({0x23, 0x00, 0x16, 1, 0x10, 0, 0x40, 0x60}).data[0], 0x80);  // the count is not 0
  EXPECT_EQ(node.ask({0x2F, 0x00, 0x16, 0, 0, 0, 0, 0}).data[0], 0x60);
  EXPECT_EQ(node.ask({0x23, 0x00, 0x16, 1, 0x10, 0, 0x41, 0x60}).data[0], 0x80);  // what it cannot map
  EXPECT_EQ(node.ask({0x23, 0x00, 0x16, 1, 0x10, 0, 0x40, 0x60}).data[0], 0x60);
  EXPECT_EQ(node.ask({0x2F, 0x00, 0x16, 0, 1, 0, 0, 0}).data[0], 0x60);
  EXPECT_EQ(node.ask({0x23, 0x00, 0x14, 1, 0x01, 0x02, 0, 0}).data[0], 0x60);
}

TEST(WireNode, APdoWorksWhenOperationalAlone) {
  Node node;
  node.receive(frame_of(0x201, {0x06, 0x00}));
  node.pass(10);
  EXPECT_EQ(node.state() & 0x40, 0x40);
  node.start();
  node.receive(frame_of(0x201, {0x06, 0x00}));
  node.pass(10);
  EXPECT_EQ(node.state(), 0x21);
  node.receive(frame_of(0x201, {0x07}));  // too short: an emergency, and nothing else
  const auto sent = node.pass(10);
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0], frame_of(0x081, {0x10, 0x82, 0x11, 0, 0, 0, 0, 0}));
  EXPECT_EQ(node.state(), 0x21);
}

TEST(WireNode, GoesFromStateToStateAsOrderedAndInNoOtherWay) {
  Node node;
  node.control(0x0F);
  EXPECT_EQ(node.state() & 0x4F, 0x40);  // no way from switch on disabled but shutdown
  node.control(0x06);
  EXPECT_EQ(node.state(), 0x21);
  node.control(0x07);
  EXPECT_EQ(node.state(), 0x23);
  node.control(0x0F);
  EXPECT_EQ(node.state(), 0x23) << "it is not operational";
  node.start();
  node.pass(20);
  EXPECT_EQ(node.state(), 0x27);
  node.control(0x02);
  EXPECT_EQ(node.state() & 0x4F, 0x40) << "option 2: it stands, and does not stay";
  (void)node.ask({0x2B, 0x5A, 0x60, 0, 6, 0, 0, 0});
  for (const int word : {0x06, 0x07, 0x0F, 0x02}) node.control(word);
  EXPECT_EQ(node.state(), 0x07);
  node.control(0x0F);
  EXPECT_EQ(node.state(), 0x27);
  EXPECT_EQ(node->drive().stops_seen(), 2);
}

TEST(WireNode, AFaultIsResetByAnEdgeOnceItsCauseIsGone) {
  Node node;
  node.start();
  node->drive().trip(0x8611, 0x21);
  const auto sent = node.pass(20);
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(sent[0], frame_of(0x081, {0x11, 0x86, 0x21, 0, 0, 0, 0, 0}));
  EXPECT_EQ(node.state() & 0x4F, 0x08);
  EXPECT_EQ(node.ask({0x40, 0x3F, 0x60, 0, 0, 0, 0, 0}),
            frame_of(0x581, {0x4B, 0x3F, 0x60, 0, 0x11, 0x86, 0, 0}));
  EXPECT_EQ(node.ask({0x40, 0x03, 0x10, 1, 0, 0, 0, 0}),
            frame_of(0x581, {0x43, 0x03, 0x10, 1, 0x11, 0x86, 0, 0}));
  node.control(0x80);
  EXPECT_EQ(node.state() & 0x4F, 0x08);
  node->drive().cause_gone();
  node.control(0x80);  // no edge
  EXPECT_EQ(node.state() & 0x4F, 0x08);
  node.control(0x00);
  node.control(0x80);
  EXPECT_EQ(node.state() & 0x4F, 0x40);
  EXPECT_EQ(node.all().back(), frame_of(0x581, {0x60, 0x40, 0x60, 0, 0, 0, 0, 0}));
}

TEST(WireNode, TakesASetPointAtTheEdgeAlone) {
  Node node;
  node.start();
  (void)node.ask({0x2F, 0x60, 0x60, 0, 1, 0, 0, 0});
  for (const int word : {0x06, 0x07, 0x0F}) node.control(word);
  (void)node.ask({0x23, 0x7A, 0x60, 0, 0xE8, 0x03, 0, 0});
  node.control(0x3F);
  EXPECT_TRUE(node->drive().statusword() & 0x1000) << "taken";
  EXPECT_FALSE(node->drive().statusword() & 0x0400) << "not there yet";
  (void)node.ask({0x23, 0x7A, 0x60, 0, 0, 0, 0, 0});
  node.control(0x3F);
  node.pass(3000);
  EXPECT_NEAR(node->drive().position(), 1000, 1) << "the second had no edge";
  EXPECT_TRUE(node->drive().statusword() & 0x0400);
  EXPECT_TRUE(node->drive().statusword() & 0x1000);
  node.control(0x2F);
  EXPECT_FALSE(node->drive().statusword() & 0x1000);
}

TEST(WireNode, LosesItsReferenceWithItsPower) {
  Node node;
  node.start();
  (void)node.ask({0x2F, 0x60, 0x60, 0, 6, 0, 0, 0});
  for (const int word : {0x06, 0x07, 0x0F}) node.control(word);
  (void)node.ask({0x2F, 0x98, 0x60, 0, 35, 0, 0, 0});
  node.control(0x1F);
  node.pass(100);
  EXPECT_TRUE(node->drive().statusword() & 0x1000);
  node.receive(frame_of(0x000, {0x81, 0x01}));
  node.pass(100);
  EXPECT_EQ(node->nmt_state(), 0x7F);
  (void)node.ask({0x2F, 0x60, 0x60, 0, 6, 0, 0, 0});
  EXPECT_FALSE(node->drive().statusword() & 0x1000);
}

// Two on a hub, besides each other.
class OnAHub : public testing::Test {
 protected:
  std::unique_ptr<CanBus> connect() {
    auto bus = CanBus::open("unix:" + hub_.path().string(), {});
    EXPECT_TRUE(bus.has_value()) << bus.error().text();
    return bus ? std::move(*bus) : nullptr;
  }
  static std::optional<can_frame> next(CanBus& bus, milliseconds within = milliseconds(1000)) {
    const auto frame = bus.read(Steady::now() + within);
    EXPECT_TRUE(frame.has_value()) << frame.error().text();
    return frame ? *frame : std::nullopt;
  }
  static void send(CanBus& bus, const can_frame& frame) {
    const auto sent = bus.write(frame, Steady::now() + milliseconds(1000));
    EXPECT_TRUE(sent.has_value()) << sent.error().text();
  }
  // The hub knows those who connected once a frame has come to them.
  void settle(CanBus& a, CanBus& b) {
    while (!b.read(Steady::now() + milliseconds(20)).value_or(std::nullopt)) send(a, frame_of(0x7FF, {}));
    while (b.read(Steady::now() + milliseconds(20)).value_or(std::nullopt)) {
    }
  }

  test::TemporaryFolder folder_;
  CanHub hub_{folder_ / "can"};
};

TEST_F(OnAHub, EveryFrameReachesAllOthersInOrder) {
  const auto a = connect(), b = connect(), c = connect();
  settle(*a, *b);
  settle(*a, *c);
  for (int i = 0; i < 100; ++i) send(*a, frame_of(0x123, {i, 2, 3}));
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(next(*b), frame_of(0x123, {i, 2, 3}));
    EXPECT_EQ(next(*c), frame_of(0x123, {i, 2, 3}));
  }
  EXPECT_EQ(next(*a, milliseconds(20)), std::nullopt);
}

TEST_F(OnAHub, SpoilsWhatItIsTold) {
  const auto a = connect(), b = connect();
  settle(*a, *b);
  const can_frame frame = frame_of(0x581, {1, 2, 3, 4}), other = frame_of(0x701, {5});
  hub_.spoil(CanHub::Fault::drop, 0x581, 1);
  send(*a, frame);
  send(*a, other);
  EXPECT_EQ(next(*b), other);
  hub_.spoil(CanHub::Fault::duplicate, 0x581, 1);
  send(*a, frame);
  EXPECT_EQ(next(*b), frame);
  EXPECT_EQ(next(*b), frame);
  hub_.spoil(CanHub::Fault::garble, 0x581, 1);
  send(*a, frame);
  const auto garbled = next(*b);
  ASSERT_TRUE(garbled);
  EXPECT_EQ(garbled->can_id, 0x581U);
  EXPECT_EQ(garbled->can_dlc, 4);
  EXPECT_FALSE(*garbled == frame);
  // Delayed: others overtake it, its own kind does not.
  hub_.spoil(CanHub::Fault::delay, 0x581, 1, milliseconds(50));
  const auto sent = Steady::now();
  send(*a, frame);
  send(*a, frame_of(0x581, {9}));
  send(*a, other);
  EXPECT_EQ(next(*b), other);
  EXPECT_EQ(next(*b), frame);
  EXPECT_GE(Steady::now() - sent, milliseconds(50));
  EXPECT_EQ(next(*b), frame_of(0x581, {9}));
}

TEST_F(OnAHub, ABusThatHangsUpIsLost) {
  const auto a = connect();
  hub_.take_down();
  const auto read = a->read(Steady::now() + milliseconds(1000));
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, base::ErrorCode::lost);
  const auto sent = a->write(frame_of(0x123, {}), Steady::now());
  ASSERT_FALSE(sent.has_value());
  EXPECT_EQ(sent.error().code, base::ErrorCode::lost);
  EXPECT_FALSE(CanBus::open("unix:" + hub_.path().string(), {}).has_value());
  EXPECT_EQ(CanBus::open("unix:", {}).error().code, base::ErrorCode::bad_input);
}

TEST(Console, CarriesOutOrdersAndSaysWhatIsWrong) {
  TestRig rig;
  auto& station = rig.station();
  EXPECT_EQ(obey(station, "limit 1 high on"), "ok");
  EXPECT_EQ(obey(station, "fault 1 0x8611"), "ok");
  rig.open();
  const AxisState state = rig.wait_until([](const AxisState& s) { return !s.fault.empty(); });
  EXPECT_TRUE(state.at_high_limit);
  EXPECT_EQ(obey(station, "fault 1 gone"), "ok");
  EXPECT_TRUE(rig.axis().enable(true).has_value());
  EXPECT_THAT(obey(station, "show 1"), HasSubstr("standing"));
  EXPECT_EQ(obey(station, ""), "ok");
  for (const char* wrong :
       {"limit 1 left on", "limit 1 low", "show 9", "fault 1 overload", "dance 1", "mute 1 maybe"}) {
    EXPECT_THAT(obey(station, wrong), HasSubstr("error: ")) << wrong;
  }
}

// The program, as a test in a virtual machine uses it.
TEST(Program, ServesABusObeysAndKeepsALog) {
  const test::TemporaryFolder folder;
  const std::string socket = (folder / "can").string(), control = (folder / "control").string(),
                    log = (folder / "log").string();
  ASSERT_EQ(::mkfifo(control.c_str(), 0600), 0);
  const std::string program = std::string(RIG_BINARY_DIR) + "/bin/rig-sim-canopen";
  std::vector<std::string> words{program,     "--socket", socket,  "--node", "1",
                                 "--control", control,    "--log", log};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  ASSERT_EQ(::posix_spawn(&child, program.c_str(), nullptr, nullptr, arguments.data(), environ), 0);
  {
    TestRig rig;
    rig.open_text(settings_text("unix:" + socket));
    const AxisState found = rig.wait_until([](const AxisState&) { return true; });
    EXPECT_FALSE(found.enabled);
    EXPECT_TRUE(rig.axis().enable(true).has_value());
    const int fifo = ::open(control.c_str(), O_WRONLY | O_CLOEXEC);
    ASSERT_GE(fifo, 0);
    const std::string order = "emcy 1 0x3210 4\n";
    EXPECT_EQ(::write(fifo, order.data(), order.size()), static_cast<ssize_t>(order.size()));
    ::close(fifo);
    EXPECT_THAT(rig.wait_until([](const AxisState& s) { return !s.fault.empty(); }).fault,
                HasSubstr("overvoltage"));
  }
  EXPECT_EQ(::kill(child, SIGTERM), 0);
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  const std::string frames = test::bytes_in(log);
  EXPECT_THAT(frames, HasSubstr(" unix 601#2B4060000F000000\n"));
  EXPECT_THAT(frames, HasSubstr(" unix 081#1032040000000000\n"));
}

}  // namespace
}  // namespace rig::drivers::cia402
