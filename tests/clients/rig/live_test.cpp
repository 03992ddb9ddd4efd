// `rig live` before something that answers as rigd does: a grey card whose brightness follows the exposure.
#include "clients/rig/live.h"

#include <atomic>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "core/base/interrupt.h"
#include "protocol/frame_door.h"
#include "tests/clients/rig/fake_rigd.h"
#include "tests/core/temporary_folder.h"

namespace rig::client {
namespace {

using base::ErrorCode;
using protocol::Reply;
using protocol::Request;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr std::uint32_t kWidth = 40;
constexpr std::uint32_t kHeight = 30;

// Of 12 bits, `level` of full scale everywhere.
protocol::Frame grey_card(double level, const protocol::Snap& wanted) {
  protocol::Frame frame;
  frame.set_exposure_us(wanted.exposure_us());
  frame.set_width(kWidth);
  frame.set_height(kHeight);
  frame.set_bits(12);
  frame.set_bayer("RGGB");
  const auto value = static_cast<std::uint16_t>(std::clamp(level, 0.0, 1.0) * 4095);
  if (wanted.full()) {
    const std::vector<std::uint16_t> raw(std::size_t{kWidth} * kHeight, value);
    frame.set_raw(raw.data(), 2 * raw.size());
  }
  const std::uint32_t width = wanted.preview_width() == 0 ? 20 : wanted.preview_width();
  frame.set_preview_width(width);
  frame.set_preview_height(width * 3 / 4);
  frame.set_preview_rgb(std::string(3UL * width * (width * 3 / 4), static_cast<char>(value / 16)));
  return frame;
}

class LiveTest : public testing::Test {
 protected:
  std::string output(const LiveOptions& options) {
    testing::internal::CaptureStdout();
    result_ = live(to_, options);
    return testing::internal::GetCapturedStdout();
  }
  static LiveOptions once() {
    LiveOptions options;
    options.once = true;
    return options;
  }
  [[nodiscard]] std::vector<protocol::Snap> snaps() const {
    std::vector<protocol::Snap> out;
    for (const auto& request : rigd_.requests()) {
      if (request.has_snap()) out.push_back(request.snap());
    }
    return out;
  }

  test::TemporaryFolder folder_;
  double level_per_us_ = 1e-5;
  std::function<std::optional<Reply>(std::size_t)> instead_ = [](std::size_t) { return std::nullopt; };
  std::size_t snaps_ = 0;
  test::FakeRigd rigd_{folder_ / "run", [this](const Request& request, test::FakeRigd&) {
                         Reply reply = test::outcome(protocol::DONE);
                         if (request.has_get_status()) reply.mutable_status()->set_rig_name("fake");
                         if (!request.has_snap()) return reply;
                         if (auto other = instead_(snaps_++)) return *other;
                         *reply.mutable_frame() =
                             grey_card(level_per_us_ * request.snap().exposure_us(), request.snap());
                         return reply;
                       }};
  Connection to_{rigd_.endpoint(), 60};
  Result<void> result_;
};

TEST_F(LiveTest, OncePrintsTheFiguresOfTheRawFrame) {
  const std::string out = output(once());
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_EQ(out,
            "exposure_ms 20\nfocus 0\nlevel_percent 20\nsaturated_percent 0\nblack_percent 0\nfiducials "
            "0\nfiducial_ids \nregion_px 0 0 40 30\nmeasured_on raw\n"
            "frame_from socket\n");
  ASSERT_EQ(snaps().size(), 1U);
  EXPECT_TRUE(snaps()[0].full());
}

TEST_F(LiveTest, APreviewIsEnoughForASlowNetwork) {
  LiveOptions options = once();
  options.preview_width = 32;
  const std::string out = output(options);
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_THAT(out, HasSubstr("region_px 0 0 32 24\nmeasured_on preview\n"));
  EXPECT_FALSE(snaps()[0].full());
  EXPECT_EQ(snaps()[0].preview_width(), 32U);
}

TEST_F(LiveTest, AutoEndsWhereTheExposureIsGood) {
  for (const double level_per_us : {1e-6, 1e-3}) {
    level_per_us_ = level_per_us;
    LiveOptions options = once();
    options.automatic = true;
    const std::string out = output(options);
    ASSERT_TRUE(result_.has_value()) << result_.error().text();
    EXPECT_THAT(out, testing::ContainsRegex("level_percent (69|70)")) << out;
  }
}

TEST_F(LiveTest, AutoGivesUpOnWhatStaysDark) {
  level_per_us_ = 0;
  LiveOptions options = once();
  options.automatic = true;
  EXPECT_THAT(output(options), HasSubstr("level_percent 0\n"));
  EXPECT_TRUE(result_.has_value());
  EXPECT_LT(snaps().size(), 20U);
}

TEST_F(LiveTest, SavesTheLastFrame) {
  for (const char* name : {"a.png", "a.tif"}) {
    LiveOptions options = once();
    options.save = folder_ / name;
    options.preview_width = 32;
    (void)output(options);
    ASSERT_TRUE(result_.has_value()) << result_.error().text();
    EXPECT_TRUE(std::filesystem::exists(folder_ / name));
  }
  EXPECT_TRUE(snaps().back().full()) << "a .tif wants the raw samples, whatever is measured";
}

TEST_F(LiveTest, TellsMistakesBeforeAnythingIsExposed) {
  LiveOptions options;
  options.save = folder_ / "a.jpg";
  (void)output(options);
  EXPECT_EQ(result_.error().code, ErrorCode::bad_input);
  options = {};
  options.config = folder_ / "no such rig.toml";
  (void)output(options);
  EXPECT_EQ(result_.error().code, ErrorCode::not_found);
  EXPECT_THAT(snaps(), IsEmpty());
}

TEST_F(LiveTest, ARefusalAtTheBeginningIsTheEnd) {
  instead_ = [](std::size_t) { return test::outcome(protocol::REFUSED, "a job is running"); };
  (void)output({});
  ASSERT_FALSE(result_.has_value());
  EXPECT_EQ(result_.error().text(), "refused: a job is running");
}

TEST_F(LiveTest, FramesOfAnotherCameraThanTheFileHasAreAnError) {
  LiveOptions options = once();
  options.config = RIG_SOURCE_DIR "/share/virtual/rig.toml";
  (void)output(options);
  ASSERT_FALSE(result_.has_value());
  EXPECT_THAT(result_.error().text(), HasSubstr("another camera"));
}

TEST_F(LiveTest, AnAnswerThatContradictsItselfIsAnError) {
  for (int fault = 0; fault < 4; ++fault) {
    instead_ = [fault](std::size_t) {
      protocol::Snap wanted;
      wanted.set_full(true);
      Reply reply = test::outcome(protocol::DONE);
      auto& frame = *reply.mutable_frame() = grey_card(0.5, wanted);
      if (fault == 0) frame.clear_raw();
      if (fault == 1) frame.set_height(kHeight + 1);
      if (fault == 2) frame.set_bits(17);
      if (fault == 3) frame.set_bayer("WXYZ");
      return reply;
    };
    (void)output(once());
    EXPECT_FALSE(result_.has_value()) << fault;
  }
}

// Beside rigd's sockets there is the one that hands out its memory.
class LiveOnTheSameMachine : public LiveTest {
 protected:
  LiveOnTheSameMachine() {
    auto door = protocol::FrameDoor::open(folder_ / "run");
    EXPECT_TRUE(door.has_value());
    door_ = std::move(*door);
    auto buffer = protocol::FrameBuffer::make(std::size_t{kWidth} * kHeight);
    EXPECT_TRUE(buffer.has_value());
    buffer_.emplace(std::move(*buffer));
    instead_ = [this](std::size_t snap) {
      protocol::Snap wanted;
      wanted.set_exposure_us(20000);
      wanted.set_full(!tells_);
      Reply reply = test::outcome(protocol::DONE);
      auto& frame = *reply.mutable_frame() = grey_card(0.2, wanted);
      frame.set_counter(100 + snap);
      if (tells_) {
        publish(99, 0.9);  // somebody else's
        publish(100 + snap, 0.4);
        if (overtaken_) buffer_->begin();
      }
      return reply;
    };
  }
  void publish(std::uint64_t counter, double level) {
    // A client is let in by another thread.
    for (int i = 0; i < 1000 && door_->clients() == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    buffer_->begin();
    std::fill(buffer_->pixels().begin(), buffer_->pixels().end(), static_cast<std::uint16_t>(level * 4095));
    protocol::LocalFrame told;
    told.set_generation(buffer_->complete());
    told.set_width(kWidth);
    told.set_height(kHeight);
    told.set_counter(counter);
    door_->publish(told, *buffer_);
  }

  bool tells_ = true, overtaken_ = false;
  std::unique_ptr<protocol::FrameDoor> door_;
  std::optional<protocol::FrameBuffer> buffer_;
};

TEST_F(LiveOnTheSameMachine, SamplesComeFromRigdsMemory) {
  const std::string out = output(once());
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_THAT(out, HasSubstr("level_percent 40\n"));
  EXPECT_THAT(out, HasSubstr("measured_on raw\nframe_from memory\n"));
  ASSERT_EQ(snaps().size(), 1U);
  EXPECT_FALSE(snaps()[0].full()) << "they need not go through the socket";
}

TEST_F(LiveOnTheSameMachine, WhatIsNotInMemoryComesThroughTheSocket) {
  tells_ = false;
  const std::string out = output(once());
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_THAT(out, HasSubstr("level_percent 20\n"));
  EXPECT_THAT(out, HasSubstr("frame_from socket\n"));
  ASSERT_EQ(snaps().size(), 2U);
  EXPECT_TRUE(snaps()[1].full());
}

TEST_F(LiveOnTheSameMachine, AFrameThatRigdHasBegunToOverwriteIsNotUsed) {
  overtaken_ = true;
  (void)output(once());
  // This rigd answers without samples then, which is no frame.
  ASSERT_EQ(snaps().size(), 2U);
  EXPECT_TRUE(snaps()[1].full());
  EXPECT_FALSE(result_.has_value());
}

TEST(LiveInterrupted, EndsCleanlyWithTheLastFrameSavedAndGoesOnOverARefusal) {
  const test::TemporaryFolder folder;
  const auto status = test::in_child([&] {
    base::catch_interrupts();
    std::size_t snaps = 0;
    const test::FakeRigd rigd(folder / "run", [&](const Request& request, test::FakeRigd&) {
      Reply reply = test::outcome(protocol::DONE);
      if (!request.has_snap()) return reply;
      ++snaps;
      if (snaps == 2) return test::outcome(protocol::REFUSED, "the rig moves");
      if (snaps == 4) ::kill(::getpid(), SIGINT);
      *reply.mutable_frame() = grey_card(0.5, request.snap());
      return reply;
    });
    LiveOptions options;
    options.save = folder / "last.png";
    EXPECT_NE(std::freopen((folder / "out").c_str(), "w", stdout), nullptr);
    const auto result = live({rigd.endpoint(), 60}, options);
    std::fflush(stdout);
    return !result && result.error().code == ErrorCode::interrupted && snaps == 4 ? 0 : 1;
  });
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "last.png"));
  const std::string out = test::bytes_in(folder / "out");
  EXPECT_THAT(out, HasSubstr("refused: the rig moves; trying again\n"));
  EXPECT_THAT(out, HasSubstr("level 50 %"));
  EXPECT_THAT(out, Not(HasSubstr("\033")));
}

}  // namespace
}  // namespace rig::client
