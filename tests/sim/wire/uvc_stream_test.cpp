// The simulated USB video camera's stream, as a host puts it together: payload headers, frames, exposure.
#include <condition_variable>
#include <deque>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mutex>

#include "sim/wire/uvc_camera.h"
#include "sim/wire/uvc_orders.h"
#include "sim/wire/uvc_picture.h"
#include "tests/sim/wire/usbip_host.h"
#include "tests/sim/wire/uvc_host.h"

namespace rig::sim::wire {
namespace {

using namespace test;
using std::chrono::milliseconds;

constexpr std::uint32_t k30Hz = 333'333;

struct Header {
  bool odd = false, end = false, error = false;
  std::uint32_t taken_us = 0;
};

Header header_of(const Bytes& payload) {
  Header h;
  if (payload.size() < 12 || payload[0] != 12) {
    ADD_FAILURE() << "no header of twelve bytes";
    return h;
  }
  EXPECT_EQ(payload[1] & 0xBC, 0x8C) << "time, clock and end of header; no still picture";
  EXPECT_LE(little(std::span(payload).subspan(10, 2)), 0x7FFU) << "eleven bits of the bus' frame number";
  h.odd = (payload[1] & 1) != 0;
  h.end = (payload[1] & 2) != 0;
  h.error = (payload[1] & 0x40) != 0;
  h.taken_us = little(std::span(payload).subspan(2, 4));
  return h;
}

struct Taken {
  Header first;
  bool error = false;
  Bytes picture;
};

// Takes what the camera sends; one that fetches at once.
class Receiver {
 public:
  UvcWires wires(bool fetches = true) {
    return {[this](std::uint8_t endpoint, Bytes data) {
              const std::lock_guard lock(mutex_);
              (endpoint == 1 ? payloads_ : status_).push_back(std::move(data));
              come_.notify_all();
            },
            [this, fetches](std::uint8_t endpoint) {
              const std::lock_guard lock(mutex_);
              return !fetches && endpoint == 1 ? payloads_.size() : 0;
            },
            [this](std::uint8_t) {
              const std::lock_guard lock(mutex_);
              payloads_.clear();
              ++forgotten;
            }};
  }
  Bytes payload() { return next(payloads_); }
  Bytes status() { return next(status_); }
  Taken frame() {
    Taken taken;
    for (bool first = true;; first = false) {
      const Bytes p = payload();
      if (p.empty()) return taken;
      EXPECT_LE(p.size(), 16384U);
      const Header h = header_of(p);
      if (first) taken.first = h;
      EXPECT_EQ(h.odd, taken.first.odd) << "all of a frame have the same identifier";
      EXPECT_EQ(h.taken_us, taken.first.taken_us);
      taken.error = taken.error || h.error;
      taken.picture.insert(taken.picture.end(), p.begin() + 12, p.end());
      if (h.end) return taken;
    }
  }
  std::size_t waiting() {
    const std::lock_guard lock(mutex_);
    return payloads_.size();
  }
  int forgotten = 0;

 private:
  Bytes next(std::deque<Bytes>& from) {
    std::unique_lock lock(mutex_);
    if (!come_.wait_for(lock, std::chrono::seconds(20), [&] { return !from.empty(); })) {
      ADD_FAILURE() << "nothing came";
      return {};
    }
    Bytes got = std::move(from.front());
    from.pop_front();
    return got;
  }

  std::mutex mutex_;
  std::condition_variable come_;
  std::deque<Bytes> payloads_, status_;
};

class UvcStream : public testing::Test {
 protected:
  UvcStream() { camera.connect(receiver.wires()); }
  ~UvcStream() override { camera.disconnect(); }

  void manual(std::uint32_t exposure, std::uint32_t gain, std::uint32_t brightness) {
    ASSERT_TRUE(host.set(kAeMode, 1));
    ASSERT_TRUE(host.set(kExposure, exposure));
    ASSERT_TRUE(host.set(kGain, gain));
    ASSERT_TRUE(host.set(kBrightness, brightness));
  }
  void order(const std::string& line) { ASSERT_TRUE(carry_out_order(camera, line)) << line; }
  std::uint32_t exposure_of(const Taken& taken) {
    const auto facts = read_uvc_picture(taken.picture, kUvcFormats[0], kUvcSizes[0]);
    EXPECT_TRUE(facts) << taken.picture.size() << " bytes";
    return facts ? facts->settings.exposure_100us : 0;
  }

  Receiver receiver;
  UvcCamera camera{"1"};
  VideoHost<UvcCamera> host{camera};
};

// Reads a frame with numbers of its own: the width, and the bits and bytes of a sample.
struct Reader {
  const Bytes& bytes;
  std::size_t width;
  int bits;
  std::size_t step;

  [[nodiscard]] std::uint32_t sample(std::size_t x, std::size_t y) const {
    return little(std::span(bytes).subspan((y * width + x) * step, step));
  }
  [[nodiscard]] std::uint32_t stamp(std::size_t from, int count) const {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) {
      const std::uint32_t s = sample(from + static_cast<std::size_t>(i), 0);
      const std::uint32_t one = 3U << (bits - 2), zero = 1U << (bits - 2);
      EXPECT_TRUE(s == zero || s == one) << s;
      if (s == one) value |= 1U << i;
    }
    return value;
  }
};

TEST_F(UvcStream, TwoFramesOf16Bits) {
  manual(123, 24, 10);
  host.start(3, 2, k30Hz);
  const Taken one = receiver.frame(), two = receiver.frame();
  for (const Taken* each : {&one, &two}) {
    ASSERT_EQ(each->picture.size(), 640U * 480 * 2);
    EXPECT_FALSE(each->error);
    const Reader r{each->picture, 640, 16, 2};
    EXPECT_EQ(r.stamp(32, 32), 123U);
    EXPECT_EQ(r.stamp(64, 16), 24U);
    EXPECT_EQ(r.stamp(80, 16), 10U);
    EXPECT_EQ(r.stamp(96, 16), 256U);
    for (std::size_t y = 1; y < 480; ++y) {
      for (std::size_t x = 0; x < 640; ++x) {
        const std::size_t band = 1 + x / 80;
        ASSERT_EQ(r.sample(x, y), 160 + std::size_t{123} * 24 * band) << x << ", " << y;
      }
    }
  }
  EXPECT_NE(one.first.odd, two.first.odd);
  EXPECT_EQ(Reader({two.picture, 640, 16, 2}).stamp(0, 32),
            Reader({one.picture, 640, 16, 2}).stamp(0, 32) + 1);
  EXPECT_GE(two.first.taken_us - one.first.taken_us, 33'333U);
  EXPECT_EQ(camera.state().overrun, 0);
  host.stop();
  EXPECT_FALSE(camera.state().streaming);
  EXPECT_EQ(camera.state().stops, 1);
}

TEST_F(UvcStream, OtherFormatsHaveTheUpperBits) {
  manual(300, 32, 255);
  struct Row {
    std::uint8_t format;
    int bits;
    std::size_t step;
  };
  for (const Row& row : {Row{1, 8, 1}, Row{2, 12, 2}, Row{4, 8, 1}}) {
    host.start(row.format, 1, k30Hz);
    const Taken taken = receiver.frame();
    ASSERT_EQ(taken.picture.size(), std::size_t{320} * 240 * row.step);
    const Reader r{taken.picture, 320, row.bits, row.step};
    EXPECT_EQ(r.stamp(32, 32), 300U);
    for (std::size_t y = 1; y < 240; ++y) {
      for (std::size_t x = 0; x < 320; ++x) {
        std::size_t light = std::size_t{300} * 32 * (1 + x / 40);
        if (row.format == 4 && x % 2 == 0 && y % 2 == 0) light /= 2;  // red
        if (row.format == 4 && x % 2 == 1 && y % 2 == 1) light /= 4;  // blue
        ASSERT_EQ(r.sample(x, y),
                  std::min<std::size_t>(65535, std::size_t{16} * 255 + light) >> (16 - row.bits))
            << int{row.format} << ": " << x << ", " << y;
      }
    }
    host.stop();
  }
}

TEST_F(UvcStream, ALongExposureMakesTheFramesSlow) {
  manual(1200, 16, 0);
  host.start(1, 1, k30Hz);
  const Taken one = receiver.frame(), two = receiver.frame();
  EXPECT_GE(two.first.taken_us - one.first.taken_us, 120'000U);
  EXPECT_EQ(exposure_of(one), 1200U);
}

TEST_F(UvcStream, ASettingIsInAFrameAfterThoseOnTheirWay) {
  manual(400, 16, 0);
  order("delay 3");
  host.start(1, 1, k30Hz);
  // The first frame has come: the second has begun, or will soon, with the old exposure.
  EXPECT_EQ(exposure_of(receiver.frame()), 400U);
  const std::uint32_t begun = camera.state().frame;
  ASSERT_TRUE(host.set(kExposure, 100));
  const std::uint32_t begun_then = camera.state().frame;
  for (std::uint32_t number = 2;; ++number) {
    const Taken taken = receiver.frame();
    ASSERT_FALSE(taken.picture.empty());
    const bool new_one = exposure_of(taken) == 100;
    if (number <= begun + 3) {
      EXPECT_FALSE(new_one) << number;
    }
    if (number > begun_then + 3) {
      EXPECT_TRUE(new_one) << number;
    }
    if (new_one) break;
  }
}

TEST_F(UvcStream, WithoutDelayTheNextFrameHasIt) {
  manual(400, 16, 0);
  order("delay 0");
  host.start(1, 1, k30Hz);
  EXPECT_EQ(exposure_of(receiver.frame()), 400U);
  ASSERT_TRUE(host.set(kExposure, 200));
  const std::uint32_t begun = camera.state().frame;
  for (std::uint32_t number = 2; number <= begun + 1; ++number) {
    const std::uint32_t exposure = exposure_of(receiver.frame());
    if (number == begun + 1) {
      EXPECT_EQ(exposure, 200U);
    }
  }
}

TEST_F(UvcStream, ItExposesAutomaticallyAndTellsSo) {
  order("light 512");
  host.start(1, 1, k30Hz);
  EXPECT_EQ(exposure_of(receiver.frame()), 192U) << "49152 / (8 bands * gain 16 * twice the light)";
  EXPECT_EQ(receiver.status(), (Bytes{1, 1, 0, 4, 0, 192, 0, 0, 0}));
  EXPECT_EQ(host.get(get_cur, kExposure), 192);
  // In the dark it takes as long as the interval lets it, or as long as it can.
  order("light 1");
  EXPECT_EQ(receiver.status(), (Bytes{1, 1, 0, 4, 0, 0x4D, 1, 0, 0})) << 333;
  ASSERT_TRUE(host.set(kAePriority, 1));
  EXPECT_EQ(receiver.status(), (Bytes{1, 1, 0, 4, 0, 0x20, 0x4E, 0, 0})) << 20000;
}

TEST_F(UvcStream, FramesAreDamagedDroppedAndCutOnCommand) {
  manual(50, 16, 0);
  order("damage 1");
  host.start(1, 1, k30Hz);
  const Taken damaged = receiver.frame();
  EXPECT_TRUE(damaged.error);
  EXPECT_FALSE(damaged.first.error) << "from the middle on";
  EXPECT_EQ(host.get(get_cur, kStreamError), 3) << "data discontinuity";
  host.stop();
  order("drop 2");
  const std::uint32_t before = camera.state().frame;
  host.start(1, 1, k30Hz);
  const Taken third = receiver.frame();
  EXPECT_FALSE(third.error);
  const auto facts = read_uvc_picture(third.picture, kUvcFormats[0], kUvcSizes[0]);
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->frame, before + 3);
  host.stop();
  order("cut 1 25");
  host.start(1, 1, k30Hz);
  EXPECT_EQ(receiver.frame().picture.size(), 320U * 240 / 4);
  EXPECT_EQ(receiver.frame().picture.size(), 320U * 240);
  host.stop();
  order("cut 1 0");
  host.start(1, 1, k30Hz);
  EXPECT_EQ(receiver.frame().picture.size(), 0U);
}

TEST_F(UvcStream, ASlowHostLosesWholeFrames) {
  camera.connect(receiver.wires(false));
  manual(10, 16, 0);
  host.start(1, 1, k30Hz);
  while (camera.state().overrun < 2) std::this_thread::yield();
  EXPECT_EQ(camera.state().sent, 1);
  const Taken first = receiver.frame();
  EXPECT_EQ(first.picture.size(), 320U * 240);
  const Taken next = receiver.frame();
  EXPECT_NE(first.first.odd, next.first.odd);
  const auto facts = read_uvc_picture(next.picture, kUvcFormats[0], kUvcSizes[0]);
  ASSERT_TRUE(facts);
  EXPECT_GE(facts->frame, 4U);
}

TEST_F(UvcStream, NothingComesAfterAStop) {
  manual(10, 16, 0);
  host.start(1, 1, k30Hz);
  EXPECT_FALSE(receiver.payload().empty());
  const int before = receiver.forgotten;
  host.stop();
  EXPECT_EQ(receiver.forgotten, before + 1);
  EXPECT_EQ(receiver.waiting(), 0U);
  const std::uint32_t number = camera.state().frame;
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(receiver.waiting(), 0U);
  EXPECT_EQ(camera.state().frame, number);
  // Selecting the interface's setting ends a stream too.
  host.start(1, 1, k30Hz);
  EXPECT_EQ(camera.control({0x01, 11, 0, 1, 0}, {}).kind, ControlAnswer::Kind::done);
  EXPECT_FALSE(camera.state().streaming);
}

TEST_F(UvcStream, WithoutWiresFramesAreLost) {
  camera.connect({});
  host.start(1, 1, k30Hz);
  while (camera.state().overrun < 1) std::this_thread::yield();
  EXPECT_EQ(camera.state().sent, 0);
}

// The same camera behind USB/IP: transfers of a host that asks for 16 KiB each.
TEST(UvcOverUsbIp, AFrameInBulkTransfers) {
  UvcCamera camera("1");
  const Host bus(
      [&camera](const SetupPacket& s, std::span<const std::uint8_t> out) { return camera.control(s, out); });
  camera.connect({[&](std::uint8_t endpoint, Bytes data) { bus.device->send(endpoint, std::move(data)); },
                  [&](std::uint8_t endpoint) { return bus.device->unfetched(endpoint); },
                  [&](std::uint8_t endpoint) { bus.device->forget(endpoint); }});
  VideoHost<UvcCamera>{camera}.start(3, 1, k30Hz);
  Bytes picture;
  for (std::uint32_t number = 1; number < 20; ++number) {
    bus.submit(number, true, 1, 16384);
    const auto r = bus.answer(true);
    ASSERT_EQ(r.status, 0);
    const Header h = header_of(r.data);
    picture.insert(picture.end(), r.data.begin() + 12, r.data.end());
    if (h.end) break;
    EXPECT_EQ(r.length, 16384U) << "a payload fills a transfer, but for the last";
  }
  const auto facts = read_uvc_picture(picture, kUvcFormats[2], kUvcSizes[0]);
  ASSERT_TRUE(facts);
  EXPECT_EQ(facts->frame, 1U);
  picture[picture.size() / 2] ^= 1;
  EXPECT_FALSE(read_uvc_picture(picture, kUvcFormats[2], kUvcSizes[0]));
  picture.pop_back();
  EXPECT_FALSE(read_uvc_picture(picture, kUvcFormats[2], kUvcSizes[0]));
  const Bytes stop{0x02, 1, 0, 0, 0x81, 0, 0, 0};
  bus.submit(30, false, 0, 0, stop);
  for (auto r = bus.answer(true); r.number != 30; r = bus.answer(true)) {
  }
  EXPECT_EQ(bus.device->unfetched(1), 0U);
  camera.disconnect();
}

}  // namespace
}  // namespace rig::sim::wire
