// What is a message and what is not: magic, number of frames, version, and bytes that are none.
#include "protocol/envelope.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "tests/core/seed.h"

namespace rig::protocol {
namespace {

using base::ErrorCode;
using testing::HasSubstr;
using Frames = std::vector<std::string_view>;

Request some_request() {
  Request request;
  request.set_version(kVersion);
  request.set_id(77);
  auto* axis = request.mutable_move()->add_axes();
  axis->set_axis("pan");
  axis->set_angle_deg(-12.5);
  return request;
}

Message some_message() {
  Message message;
  message.set_version(kVersion);
  message.mutable_reply()->set_id(5);
  message.mutable_reply()->set_reason("beyond a limit");
  return message;
}

void expect_no_request(const Frames& frames, ErrorCode code, const std::string& said, std::uint64_t id) {
  std::uint64_t found = 0;
  const auto request = read_request(frames, found);
  ASSERT_FALSE(request.has_value()) << said;
  EXPECT_EQ(request.error().code, code);
  EXPECT_THAT(request.error().text(), HasSubstr(said));
  EXPECT_EQ(found, id) << said;
}

TEST(Envelope, AGoodRequestIsReadWhole) {
  const std::string bytes = some_request().SerializeAsString();
  std::uint64_t id = 0;
  const auto request = read_request({kMagic, bytes}, id);
  ASSERT_TRUE(request.has_value()) << request.error().text();
  EXPECT_EQ(id, 77U);
  EXPECT_EQ(request->SerializeAsString(), bytes);
  EXPECT_EQ(request->move().axes(0).angle_deg(), -12.5);
}

TEST(Envelope, HasTwoFrames) {
  const std::string bytes = some_request().SerializeAsString();
  expect_no_request({}, ErrorCode::bad_input, "2 frames", 0);
  expect_no_request({kMagic}, ErrorCode::bad_input, "2 frames", 0);
  expect_no_request({bytes}, ErrorCode::bad_input, "2 frames", 0);
  expect_no_request({kMagic, bytes, ""}, ErrorCode::bad_input, "2 frames", 0);
  expect_no_request({"", kMagic, bytes}, ErrorCode::bad_input, "2 frames", 0);
}

TEST(Envelope, BeginsWithTheMagicToTheLetter) {
  const std::string bytes = some_request().SerializeAsString();
  for (const char* magic : {"", "RIG", "RIG2", "rig1", "RIG1 ", " RIG1"}) {
    expect_no_request({magic, bytes}, ErrorCode::bad_input, "RIG1", 0);
  }
  expect_no_request({bytes, kMagic}, ErrorCode::bad_input, "RIG1", 0);
}

TEST(Envelope, NamesAVersionThatIsSpokenHere) {
  Request request = some_request();
  request.set_version(kVersion + 1);
  expect_no_request({kMagic, request.SerializeAsString()}, ErrorCode::newer, "version 2", 77);
  request.set_version(0xFFFFFFFF);
  expect_no_request({kMagic, request.SerializeAsString()}, ErrorCode::newer, "version 4294967295", 77);
  request.set_version(0);
  expect_no_request({kMagic, request.SerializeAsString()}, ErrorCode::bad_input, "no protocol version", 77);
}

TEST(Envelope, HoldsACommand) {
  Request request = some_request();
  request.clear_command();
  expect_no_request({kMagic, request.SerializeAsString()}, ErrorCode::bad_input, "no command", 77);
  // A command of a later version of the protocol: field 99, an empty message.
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(99);
  expect_no_request({kMagic, request.SerializeAsString()}, ErrorCode::bad_input, "no command", 77);
  expect_no_request({kMagic, ""}, ErrorCode::bad_input, "version", 0);
}

TEST(Envelope, FieldsThatAreNotKnownDoNotMatter) {
  Request request = some_request();
  request.GetReflection()->MutableUnknownFields(&request)->AddVarint(2000, 1);
  auto* move = request.mutable_move();
  move->GetReflection()->MutableUnknownFields(move)->AddLengthDelimited(50, "later");
  std::uint64_t id = 0;
  const std::string bytes = request.SerializeAsString();
  const auto read = read_request({kMagic, bytes}, id);
  ASSERT_TRUE(read.has_value()) << read.error().text();
  EXPECT_EQ(read->move().axes(0).axis(), "pan");
}

TEST(Envelope, NoCutRequestAndNoRubbishDoesHarm) {
  const std::string bytes = some_request().SerializeAsString();
  std::mt19937_64 random(test::seed(31));
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string changed = bytes.substr(0, round % 2 == 0 ? bytes.size() : random() % bytes.size());
    for (std::uint64_t i = random() % 4; i > 0 && !changed.empty(); --i) {
      changed[random() % changed.size()] = static_cast<char>(random());
    }
    std::uint64_t id = 0;
    const auto request = read_request({kMagic, changed}, id);
    if (request) {
      EXPECT_EQ(request->version(), kVersion);
      EXPECT_EQ(request->id(), id);
      EXPECT_NE(request->command_case(), Request::COMMAND_NOT_SET);
    } else {
      EXPECT_FALSE(request.error().what.empty());
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(Envelope, MessagesOfRigdFollowTheSameRules) {
  const std::string bytes = some_message().SerializeAsString();
  const auto good = read_message({kMagic, bytes});
  ASSERT_TRUE(good.has_value()) << good.error().text();
  EXPECT_EQ(good->reply().reason(), "beyond a limit");

  EXPECT_EQ(read_message({kMagic}).error().code, ErrorCode::bad_input);
  EXPECT_EQ(read_message({"RIG9", bytes}).error().code, ErrorCode::bad_input);
  EXPECT_EQ(read_message({kMagic, bytes.substr(0, bytes.size() - 1)}).error().code, ErrorCode::bad_input);
  Message newer = some_message();
  newer.set_version(2);
  EXPECT_EQ(read_message({kMagic, newer.SerializeAsString()}).error().code, ErrorCode::newer);
}

// A body of a later version is nothing that a client must stumble over.
TEST(Envelope, AMessageMayHaveABodyThatIsNotKnown) {
  Message message;
  message.set_version(kVersion);
  message.GetReflection()->MutableUnknownFields(&message)->AddLengthDelimited(60, "later");
  const std::string bytes = message.SerializeAsString();
  const auto read = read_message({kMagic, bytes});
  ASSERT_TRUE(read.has_value()) << read.error().text();
  EXPECT_EQ(read->body_case(), Message::BODY_NOT_SET);
}

}  // namespace
}  // namespace rig::protocol
