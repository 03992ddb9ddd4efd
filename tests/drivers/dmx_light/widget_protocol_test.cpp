// Messages of the widget, byte by byte, as its specification has them.
#include "drivers/dmx_light/widget_protocol.h"

#include <gtest/gtest.h>

namespace rig::drivers::dmx_light {
namespace {

using namespace std::string_literals;

// The one message in these bytes, whole.
Message only(std::string bytes) {
  std::size_t noise = 0;
  auto message = take_message(bytes, noise);
  EXPECT_TRUE(message);
  EXPECT_EQ(noise, 0U);
  EXPECT_TRUE(bytes.empty());
  return message.value_or(Message{});
}

TEST(WidgetProtocol, Requests) {
  EXPECT_EQ(encode(Label::serial, {}), "\x7E\x0A\0\0\xE7"s);
  EXPECT_EQ(encode_parameters_request(), "\x7E\x03\x02\0\0\0\xE7"s);
  EXPECT_EQ(encode(Label::manufacturer, {}), "\x7E\x4D\0\0\xE7"s);
}

TEST(WidgetProtocol, AnOutputHasAStartCodeInFrontOfItsChannels) {
  EXPECT_EQ(encode_output("\xFF"s + std::string(23, '\0')),
            "\x7E\x06\x19\0\0\xFF"s + std::string(23, '\0') + "\xE7"s);
  const std::string full = encode_output(std::string(512, '\x01'));
  EXPECT_EQ(full.substr(0, 5), "\x7E\x06\x01\x02\0"s);
  EXPECT_EQ(full.size(), 4U + 513U + 1U);
}

TEST(WidgetProtocol, AMessageIsTakenWhole) {
  const Message message = only("\x7E\x0A\x04\0\x34\x12\x30\x02\xE7"s);
  EXPECT_EQ(message.label, 10);
  EXPECT_EQ(read_serial(message).value(), "02301234");
}

TEST(WidgetProtocol, PartsOfAMessageWaitForTheRest) {
  const std::string whole = "\x7E\x0A\x04\0\x34\x12\x30\x02\xE7"s;
  std::string come;
  std::size_t noise = 0;
  for (std::size_t i = 0; i + 1 < whole.size(); ++i) {
    come.push_back(whole[i]);
    EXPECT_FALSE(take_message(come, noise)) << i;
  }
  come.push_back(whole.back());
  EXPECT_TRUE(take_message(come, noise));
  EXPECT_EQ(noise, 0U);
}

TEST(WidgetProtocol, DataMayHoldBeginningsAndEnds) {
  const Message message = only("\x7E\x05\x04\0\x7E\xE7\x7E\xE7\xE7"s);
  EXPECT_EQ(message.data, "\x7E\xE7\x7E\xE7"s);
}

TEST(WidgetProtocol, NoiseIsPassedOverAndCounted) {
  const std::string good = "\x7E\x0A\x04\0\x34\x12\x30\x02\xE7"s;
  for (const std::string& noise :
       {"hello"s, "\xE7\xE7"s, "\x7E\x05\x01\0\x01\x02"s, "\x7E\xFF\xFF\xFF"s, "\x7E"s}) {
    std::string bytes = noise + good;
    std::size_t dropped = 0;
    const auto message = take_message(bytes, dropped);
    // A lone beginning takes the next one for its label, and finds no end where it should be.
    ASSERT_TRUE(message) << ::testing::PrintToString(noise);
    EXPECT_EQ(message->label, 10);
    EXPECT_EQ(dropped, noise.size());
  }
}

TEST(WidgetProtocol, TwoMessagesAreTakenOneAfterTheOther) {
  std::string bytes = "\x7E\x05\0\0\xE7\x7E\x0A\0\0\xE7"s;
  std::size_t noise = 0;
  EXPECT_EQ(take_message(bytes, noise)->label, 5);
  EXPECT_EQ(take_message(bytes, noise)->label, 10);
  EXPECT_FALSE(take_message(bytes, noise));
}

TEST(WidgetProtocol, Parameters) {
  const Parameters parameters = read_parameters({3, "\x2C\x01\x09\x01\x28"s}).value();
  EXPECT_EQ(parameters.firmware_major, 1);
  EXPECT_EQ(parameters.firmware_minor, 44);
  EXPECT_EQ(parameters.packets_per_s, 40);
  EXPECT_TRUE(read_parameters({3, "\x2C\x01\x09\x01\0 and more"s}));
  EXPECT_FALSE(read_parameters({3, "\x2C\x01\x09\x01"s}));
  EXPECT_FALSE(read_parameters({3, "\x2C\x01\x09\x01\x29"s}));
}

TEST(WidgetProtocol, SerialNumbers) {
  EXPECT_EQ(read_serial({10, "\xFF\xFF\xFF\xFF"s}).value(), "FFFFFFFF");
  EXPECT_FALSE(read_serial({10, "\x01\x02\x03"s}));
  EXPECT_FALSE(read_serial({10, ""s}));
}

TEST(WidgetProtocol, Names) {
  EXPECT_EQ(read_name({77,
                       "\x6B\x6A"
                       "DMXking\0\0\0"s})
                .value(),
            "DMXking");
  EXPECT_EQ(read_name({78, "\x01\0ultra\nDMX"s}).value(), "ultraDMX");
  EXPECT_FALSE(read_name({78, "\x01"s}));
  EXPECT_FALSE(read_name({78, std::string(36, 'x')}));
}

}  // namespace
}  // namespace rig::drivers::dmx_light
