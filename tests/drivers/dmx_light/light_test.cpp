// The module, loaded as rigd loads it, against a widget on a line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/drivers/common/set_clock.h"
#include "tests/drivers/dmx_light/bench.h"

namespace rig::drivers::dmx_light {
namespace {

using base::ErrorCode;
using sim::wire::DmxPro;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::uint8_t kParameters = 3, kDmx = 6, kSerialNumber = 10, kManufacturer = 77, kNonsense = 0xFF;

class DmxLight : public ::testing::Test {
 protected:
  void open(const std::string& more = "") {
    devices_.clear();
    auto opened = bench_.open_with(bench_.settings("answer_ms = 100\n" + more), &clock_);
    ASSERT_TRUE(opened) << opened.error().text();
    devices_ = std::move(*opened);
  }
  void close() { devices_.clear(); }
  [[nodiscard]] std::string refusal(const std::string& more) {
    const auto opened = bench_.open_with(bench_.settings("answer_ms = 100\n" + more), &clock_);
    return opened ? "" : opened.error().text();
  }
  Light& light() { return *std::get<std::unique_ptr<Light>>(devices_.at(0).is); }
  // The first channels that go out.
  std::vector<int> out(std::size_t channels = 3) {
    const auto all = widget_.output();
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(channels, all.size()))};
  }
  // Looks until the widget is back; the module tries once a second.
  Result<LightState> state_when_back() {
    for (int tries = 0; tries < 20; ++tries) {
      auto state = light().state();
      if (state) return state;
      clock_.pass(1);
    }
    return light().state();
  }

  DmxBench bench_;
  DmxPro& widget_ = bench_.widget();
  testing::SetClock clock_;
  std::vector<Device> devices_;
};

TEST_F(DmxLight, OpensAtItsLevelOfStartWithTheShutterClosed) {
  open("at_start_level = 0.25\nfixed = [[10, 77]]");
  EXPECT_THAT(out(10), ElementsAre(0x40, 0x00, 0, 0, 0, 0, 0, 0, 0, 77));
  EXPECT_EQ(widget_.output().size(), 512U);
  const LightState state = light().state().value();
  EXPECT_NEAR(state.level, 0.25, 1e-5);
  EXPECT_TRUE(state.on);
  EXPECT_FALSE(state.shutter_open);
  EXPECT_TRUE(state.fault.empty());
  EXPECT_FALSE(state.temperature_c);
}

TEST_F(DmxLight, LevelAndShutterGoOut) {
  open();
  EXPECT_TRUE(light().capabilities().has_level);
  EXPECT_TRUE(light().capabilities().has_shutter);
  ASSERT_TRUE(light().set_level(1));
  EXPECT_THAT(out(), ElementsAre(255, 255, 0));
  ASSERT_TRUE(light().set_shutter(true));
  EXPECT_THAT(out(), ElementsAre(255, 255, 255));
  ASSERT_TRUE(light().set_level(0.5));
  EXPECT_THAT(out(), ElementsAre(128, 0, 255));
  const LightState state = light().state().value();
  EXPECT_DOUBLE_EQ(state.level, 32768 / 65535.0);
  EXPECT_TRUE(state.shutter_open);
  for (const double wrong : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(light().set_level(wrong).error().code, ErrorCode::bad_input);
  }
  EXPECT_THAT(out(), ElementsAre(128, 0, 255));
}

TEST_F(DmxLight, WithoutAShutterItIsAlwaysOpen) {
  auto opened = bench_.open_with(
      fmt::format("port = '{}'\nchannel = 1\nchannels = 24\n", (bench_.folder() / "widget").string()),
      &clock_);
  ASSERT_TRUE(opened) << opened.error().text();
  devices_ = std::move(*opened);
  EXPECT_FALSE(light().capabilities().has_shutter);
  EXPECT_EQ(light().set_shutter(false).error().code, ErrorCode::refused);
  EXPECT_TRUE(light().state().value().shutter_open);
  ASSERT_TRUE(light().set_level(1));
  EXPECT_EQ(widget_.output().size(), 24U);
  EXPECT_THAT(out(2), ElementsAre(255, 0));
}

TEST_F(DmxLight, TheLastPacketGoesOnAfterTheEnd) {
  open("at_exit_level = 0.2");
  ASSERT_TRUE(light().set_level(1));
  ASSERT_TRUE(light().set_shutter(true));
  close();
  EXPECT_THAT(out(), ElementsAre(0x33, 0x33, 0));
}

TEST_F(DmxLight, ItIsPutOutAgainOnceASecondAndLooksDoNotDisturbIt) {
  open();
  ASSERT_TRUE(light().set_level(1));
  const int before = widget_.requests(kDmx);
  for (int i = 0; i < 9; ++i) {
    clock_.pass(0.1);
    ASSERT_TRUE(light().state());
  }
  EXPECT_EQ(widget_.requests(kDmx), before);
  EXPECT_THAT(out(), ElementsAre(255, 255, 0));
  clock_.pass(0.1);
  ASSERT_TRUE(light().state());
  EXPECT_EQ(widget_.requests(kDmx), before + 1);
  EXPECT_GE(widget_.requests(kParameters), 10);
}

TEST_F(DmxLight, AWidgetThatForgotIsGivenThePacketAgain) {
  open();
  ASSERT_TRUE(light().set_level(1));
  widget_.power_cycle();
  EXPECT_THAT(out(), ElementsAre());
  clock_.pass(1);
  ASSERT_TRUE(light().state());
  EXPECT_THAT(out(), ElementsAre(255, 255, 0));
}

TEST_F(DmxLight, TheWidgetsNumberIsChecked) {
  EXPECT_THAT(refusal("serial = '99999999'"), HasSubstr("this is widget 02301234, not 99999999"));
  EXPECT_EQ(refusal("serial = '2301234'"), "");
}

TEST_F(DmxLight, AnotherWidgetInItsPlaceStaysLost) {
  open();
  ASSERT_TRUE(light().set_level(1));
  widget_.cut();
  EXPECT_EQ(light().state().error().code, ErrorCode::lost);
  widget_.set_serial("00000001");
  widget_.restore();
  clock_.pass(1);
  const auto other = light().state();
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::lost);
  EXPECT_THAT(other.error().text(), HasSubstr("this is widget 00000001, not 02301234"));
  EXPECT_THAT(out(), ElementsAre());
  widget_.set_serial(kSerial);
  clock_.pass(1);
  EXPECT_TRUE(light().state());
}

TEST_F(DmxLight, ASnifferIsNoWidgetForLights) {
  widget_.set_firmware(3);
  EXPECT_THAT(refusal(""), HasSubstr("the firmware that only listens"));
  widget_.set_firmware(2);
  EXPECT_EQ(refusal(""), "");
}

TEST_F(DmxLight, TheLogNamesTheWidget) {
  open();
  EXPECT_THAT(logged(), ElementsAre(HasSubstr("DMX widget 02301234, firmware 1.44, 40 packets/s")));
  close();
  widget_.set_names("DMXking", "ultraDMX Micro");
  open("ask_names = true");
  EXPECT_THAT(logged(), ElementsAre(HasSubstr("DMX widget 02301234, 'DMXking', 'ultraDMX Micro', firmware")));
  EXPECT_THAT(out(), ElementsAre(0, 0, 0));
  close();
  widget_.set_names("", "");
  open("ask_names = true");
  EXPECT_THAT(logged(), ElementsAre(HasSubstr("DMX widget 02301234, firmware")));
  EXPECT_EQ(widget_.requests(kManufacturer), 2);
}

TEST_F(DmxLight, APortWithNothingBehindItIsAnError) {
  widget_.spoil(DmxPro::Spoil::missing, 1000);
  EXPECT_THAT(refusal(""), HasSubstr("no answer of the widget within 100 ms, 3 times"));
  widget_.spoil(DmxPro::Spoil::garbage, 1000);
  EXPECT_THAT(refusal(""), HasSubstr("no answer of a widget"));
  widget_.cut();
  EXPECT_THAT(refusal(""), HasSubstr("cannot open the serial line"));
}

TEST_F(DmxLight, AWidgetThatWasLeftInTheMiddleOfAMessageIsBroughtBack) {
  widget_.feed(std::string("\x7E\x06\x01\x02", 4) + std::string(17, '\x05'));
  open();
  EXPECT_EQ(widget_.requests(kNonsense), 1);
  EXPECT_EQ(widget_.requests(kSerialNumber), 1);
  ASSERT_TRUE(light().set_level(1));
  EXPECT_THAT(out(), ElementsAre(255, 255, 0));
}

TEST_F(DmxLight, ASpoiltAnswerIsAskedForAgain) {
  open();
  double level = 0;
  for (const auto how :
       {DmxPro::Spoil::missing, DmxPro::Spoil::garbage, DmxPro::Spoil::late, DmxPro::Spoil::duplicate}) {
    for (const int answers : {1, 2}) {
      level += 0.1;
      widget_.spoil(how, answers);
      ASSERT_TRUE(light().set_level(level)) << static_cast<int>(how) << ", " << answers;
      EXPECT_EQ(out().at(0), static_cast<int>(std::lround(level * 65535)) / 256);
      EXPECT_NEAR(light().state().value().level, level, 1e-5);
    }
  }
}

TEST_F(DmxLight, AWidgetThatTalksNonsenseIsAFaultAndWhatWasAskedOfItIsNotClaimed) {
  open();
  ASSERT_TRUE(light().set_level(0.5));
  widget_.spoil(DmxPro::Spoil::garbage, 3);
  const auto set = light().set_level(1);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::device);
  EXPECT_THAT(set.error().text(), HasSubstr("3 times"));
  // The next look puts it out again and proves it.
  const int before = widget_.requests(kDmx);
  EXPECT_EQ(light().state().value().level, 1);
  EXPECT_EQ(widget_.requests(kDmx), before + 1);
  EXPECT_THAT(out(), ElementsAre(255, 255, 0));
}

TEST_F(DmxLight, DmxThatTheWidgetReceivesIsPassedOver) {
  open();
  widget_.send_received_dmx();
  EXPECT_TRUE(light().set_level(1));
  widget_.send_received_dmx();
  EXPECT_TRUE(light().state());
}

TEST_F(DmxLight, ASilentWidgetIsLostAndComesBackAtItsLevelOfStart) {
  open("at_start_level = 0.1");
  ASSERT_TRUE(light().set_level(1));
  ASSERT_TRUE(light().set_shutter(true));
  widget_.spoil(DmxPro::Spoil::missing, 4);
  EXPECT_EQ(light().state().error().code, ErrorCode::lost);
  const auto back = state_when_back();
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_NEAR(back->level, 0.1, 1e-5);
  EXPECT_FALSE(back->shutter_open);
}

TEST_F(DmxLight, AnUnpluggedWidgetIsLostAndComesBackAtItsLevelOfStart) {
  open();
  ASSERT_TRUE(light().set_level(1));
  ASSERT_TRUE(light().set_shutter(true));
  widget_.cut();
  EXPECT_EQ(light().state().error().code, ErrorCode::lost);
  EXPECT_EQ(light().set_level(0).error().code, ErrorCode::lost);
  widget_.restore();
  const auto back = state_when_back();
  ASSERT_TRUE(back) << back.error().text();
  EXPECT_EQ(back->level, 0);
  EXPECT_FALSE(back->on);
  EXPECT_FALSE(back->shutter_open);
  EXPECT_THAT(out(), ElementsAre(0, 0, 0));
  EXPECT_EQ(logged().size(), 2U);  // who it is, each time
}

TEST_F(DmxLight, ItWarmsUpAndCountsItsHours) {
  open("warm_up_s = 60");
  EXPECT_EQ(light().capabilities().warm_up_s, 60);
  ASSERT_TRUE(light().set_level(1));
  EXPECT_FALSE(light().state().value().warm);
  clock_.pass(60);
  EXPECT_TRUE(light().state().value().warm);
  widget_.cut();
  EXPECT_FALSE(light().state());
  widget_.restore();
  EXPECT_TRUE(state_when_back());
  ASSERT_TRUE(light().set_level(1));
  EXPECT_FALSE(light().state().value().warm);
  clock_.pass(3540);
  const double hours = light().state().value().hours;
  EXPECT_GE(hours, 1);
  ASSERT_TRUE(light().set_level(0));
  EXPECT_DOUBLE_EQ(light().state().value().hours, hours);
  open();
  EXPECT_DOUBLE_EQ(light().state().value().hours, hours);
}

TEST_F(DmxLight, ARecordOfHoursThatIsDamagedIsAnError) {
  test::put_bytes(bench_.folder() / "light.hours", "nonsense");
  EXPECT_THAT(refusal(""), HasSubstr("no record of a lamp's hours"));
}

}  // namespace
}  // namespace rig::drivers::dmx_light
