// `rig frame`: what lies there from before is gone on with, or begun anew where it is of no use.
#include "clients/rig/fetch_frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <span>

#include "core/base/hash.h"
#include "tests/clients/rig/fake_rigd.h"
#include "tests/core/temporary_folder.h"

namespace rig::client {
namespace {

using base::ErrorCode;
using protocol::Reply;
using protocol::Request;
using testing::ElementsAre;
using testing::HasSubstr;

std::string some_bytes() {
  std::string bytes;
  for (int i = 0; i < 1000; ++i) bytes += static_cast<char>(i * 7 % 251);
  return bytes;
}

class FetchFrame : public testing::Test {
 protected:
  Reply answer(const Request& request) {
    const auto& get = request.get_frame();
    if (get.length() != 1) offsets_.push_back(get.offset());
    if (get.offset() > bytes_.size()) return test::outcome(protocol::FAILED, "beyond the file");
    Reply reply = test::outcome(protocol::DONE);
    auto& piece = *reply.mutable_frame_piece();
    piece.set_file_bytes(bytes_.size());
    piece.set_sha256(told_hash_);
    piece.set_offset(get.offset());
    if (!silent_)
      piece.set_content(
          bytes_.substr(get.offset(), std::min<std::size_t>(400, get.length() == 0 ? 400 : get.length())));
    return reply;
  }
  void fetch() { result_ = fetch_frame({rigd_.endpoint(), 60}, {3, 4, 0, out_}); }
  void expect_fetched() {
    ASSERT_TRUE(result_.has_value()) << result_.error().text();
    EXPECT_EQ(test::bytes_in(out_), bytes_);
    EXPECT_FALSE(std::filesystem::exists(part_));
  }

  test::TemporaryFolder folder_;
  const std::string out_ = folder_ / "frame.tif", part_ = folder_ / "frame.tif.part";
  const std::string bytes_ = some_bytes();
  std::string told_hash_ = base::sha256_hex(std::as_bytes(std::span(bytes_)));
  bool silent_ = false;
  std::vector<std::uint64_t> offsets_;
  test::FakeRigd rigd_{folder_ / "run",
                       [this](const Request& request, test::FakeRigd&) { return answer(request); }};
  Result<void> result_;
};

TEST_F(FetchFrame, ComesInPieces) {
  fetch();
  expect_fetched();
  EXPECT_THAT(offsets_, ElementsAre(0, 400, 800));
}

TEST_F(FetchFrame, GoesOnWhereItBrokeOff) {
  test::put_bytes(part_, bytes_.substr(0, 500));
  fetch();
  expect_fetched();
  EXPECT_THAT(offsets_, ElementsAre(500, 900));
}

TEST_F(FetchFrame, AWholePartIsOnlyProven) {
  test::put_bytes(part_, bytes_);
  fetch();
  expect_fetched();
  EXPECT_THAT(offsets_, ElementsAre(1000));
}

TEST_F(FetchFrame, ACorruptPartIsFetchedAnew) {
  std::string corrupt = bytes_.substr(0, 500);
  corrupt[17] ^= 1;
  test::put_bytes(part_, corrupt);
  fetch();
  expect_fetched();
  EXPECT_THAT(offsets_, ElementsAre(500, 900, 0, 400, 800));
}

TEST_F(FetchFrame, APartLongerThanTheFrameIsBegunAnew) {
  test::put_bytes(part_, bytes_ + "more");
  fetch();
  expect_fetched();
  EXPECT_THAT(offsets_, ElementsAre(0, 400, 800));
}

TEST_F(FetchFrame, WhatHasAnotherHashIsNotKept) {
  told_hash_ = std::string(64, 'a');
  fetch();
  ASSERT_FALSE(result_.has_value());
  EXPECT_EQ(result_.error().code, ErrorCode::damaged);
  EXPECT_FALSE(std::filesystem::exists(out_));
  EXPECT_FALSE(std::filesystem::exists(part_));
  EXPECT_EQ(offsets_.size(), 3U) << "nothing lay there from before, whose fault it could be";
}

TEST_F(FetchFrame, AnswersWithoutContentEndIt) {
  silent_ = true;
  fetch();
  ASSERT_FALSE(result_.has_value());
  EXPECT_THAT(result_.error().text(), HasSubstr("not the piece that was asked for"));
}

}  // namespace
}  // namespace rig::client
