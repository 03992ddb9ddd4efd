// One photograph from a rig to a file, whole or not at all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/rig/commands.h"
#include "core/base/random.h"
#include "tests/clients/rig/fake_rigd.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

// Last: it defines macros that hide the byte swaps of the system, which Protocol Buffers uses.
#include <OpenImageIO/imageio.h>

namespace rig::client {
namespace {

using base::ErrorCode;
using protocol::Request;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint32_t kWidth = 40;
constexpr std::uint32_t kHeight = 30;

class Snap : public testing::Test {
 protected:
  Snap() {
    std::filesystem::create_directory(shots_);
    base::Random random(test::seed(51));
    for (std::uint32_t i = 0; i < kWidth * kHeight; ++i)
      raw_.push_back(static_cast<std::uint16_t>(random.below(65536)));
    for (std::uint32_t i = 0; i < 3 * (kWidth / 2) * (kHeight / 2); ++i)
      preview_ += static_cast<char>(random.below(256));
    auto& frame = *answer_.mutable_frame();
    frame.set_exposure_us(19999.6);
    frame.set_saturated_share(0.0125);
    frame.set_preview_width(kWidth / 2);
    frame.set_preview_height(kHeight / 2);
    frame.set_preview_rgb(preview_);
  }

  void answer_raw() {
    answer_.mutable_frame()->set_width(kWidth);
    answer_.mutable_frame()->set_height(kHeight);
    answer_.mutable_frame()->set_raw(raw_.data(), 2 * raw_.size());
  }

  // A snap that ends with an Error and leaves the folder as it was.
  base::Error refused(const std::filesystem::path& out) const {
    const auto before = test::everything_in(shots_);
    const auto done = snap(to_, 20000, out);
    EXPECT_FALSE(done.has_value()) << out;
    EXPECT_EQ(test::everything_in(shots_), before);
    return done ? base::Error{} : done.error();
  }

  template <typename Sample>
  static std::vector<Sample> samples_in(const std::filesystem::path& path, OIIO::TypeDesc type, int width,
                                        int height, int channels) {
    auto in = OIIO::ImageInput::open(path.string());
    EXPECT_TRUE(in) << OIIO::geterror();
    if (!in) return {};
    EXPECT_EQ(in->spec().width, width);
    EXPECT_EQ(in->spec().height, height);
    EXPECT_EQ(in->spec().nchannels, channels);
    EXPECT_EQ(in->spec().format, type);
    std::vector<Sample> samples(static_cast<std::size_t>(width * height * channels));
    EXPECT_TRUE(in->read_image(0, 0, 0, channels, type, samples.data())) << in->geterror();
    return samples;
  }

  test::TemporaryFolder folder_;
  const std::filesystem::path shots_ = folder_ / "shots";
  std::vector<std::uint16_t> raw_;
  std::string preview_;
  protocol::Reply answer_ = test::outcome(protocol::DONE);
  test::FakeRigd rigd_{folder_ / "run", [this](const Request&, test::FakeRigd&) { return answer_; }};
  Connection to_{rigd_.endpoint(), 60};
};

TEST_F(Snap, WritesThePreviewAsPng) {
  testing::internal::CaptureStdout();
  const auto done = snap(to_, 20000, shots_ / "a.png");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "exposure 20000 us, 1.250 % of the sample saturated\n");
  ASSERT_TRUE(done.has_value()) << done.error().text();
  const auto pixels = samples_in<char>(shots_ / "a.png", OIIO::TypeDesc::UINT8, 20, 15, 3);
  EXPECT_TRUE(std::string(pixels.begin(), pixels.end()) == preview_);
  EXPECT_EQ(test::everything_in(shots_), std::set<std::string>{"a.png"});
  ASSERT_EQ(rigd_.requests().size(), 1U);
  EXPECT_EQ(rigd_.requests()[0].snap().exposure_us(), 20000);
  EXPECT_FALSE(rigd_.requests()[0].snap().full());
}

TEST_F(Snap, WritesTheRawSamplesAsTiff) {
  answer_raw();
  for (const char* name : {"a.tif", "a.tiff"}) {
    const auto done = snap(to_, 20000, shots_ / name);
    ASSERT_TRUE(done.has_value()) << done.error().text();
    EXPECT_TRUE(samples_in<std::uint16_t>(shots_ / name, OIIO::TypeDesc::UINT16, 40, 30, 1) == raw_);
  }
  EXPECT_EQ(test::everything_in(shots_), (std::set<std::string>{"a.tif", "a.tiff"}));
  EXPECT_TRUE(rigd_.requests()[0].snap().full());
}

TEST_F(Snap, TakesThePlaceOfTheLastOne) {
  test::put_bytes(shots_ / "a.png", std::string(100000, 'x'));
  ASSERT_TRUE(snap(to_, 20000, shots_ / "a.png").has_value());
  const auto pixels = samples_in<char>(shots_ / "a.png", OIIO::TypeDesc::UINT8, 20, 15, 3);
  EXPECT_TRUE(std::string(pixels.begin(), pixels.end()) == preview_);
  EXPECT_EQ(test::everything_in(shots_), std::set<std::string>{"a.png"});
}

TEST_F(Snap, AsksForNoExposureItCannotWrite) {
  for (const char* name : {"a.jpg", "a", "a.png.gz", ".png"})
    EXPECT_EQ(refused(shots_ / name).code, ErrorCode::bad_input) << name;
  EXPECT_THAT(rigd_.requests(), IsEmpty());
}

TEST_F(Snap, LeavesNothingWhereRigdRefused) {
  test::put_bytes(shots_ / "a.png", "the one before");
  answer_ = test::outcome(protocol::REFUSED, "the light is not warm");
  EXPECT_EQ(refused(shots_ / "a.png").text(), "refused: the light is not warm");
  EXPECT_EQ(refused(shots_ / "b.tif").code, ErrorCode::refused);
  EXPECT_EQ(test::bytes_in(shots_ / "a.png"), "the one before");
}

TEST_F(Snap, LeavesNothingWhereTheAnswerContradictsItself) {
  // No raw samples though they were asked for.
  EXPECT_EQ(refused(shots_ / "a.tif").code, ErrorCode::damaged);
  answer_raw();
  answer_.mutable_frame()->set_height(kHeight + 1);
  EXPECT_EQ(refused(shots_ / "a.tif").code, ErrorCode::damaged);
  answer_.mutable_frame()->set_width(0xffffffff);
  answer_.mutable_frame()->set_height(0xffffffff);
  EXPECT_EQ(refused(shots_ / "a.tif").code, ErrorCode::damaged);
  answer_.mutable_frame()->clear_raw();
  answer_.mutable_frame()->set_preview_width(7);
  EXPECT_EQ(refused(shots_ / "a.png").code, ErrorCode::damaged);
  answer_.clear_frame();
  const base::Error none = refused(shots_ / "a.png");
  EXPECT_EQ(none.code, ErrorCode::damaged);
  EXPECT_THAT(none.what, HasSubstr("no image"));
}

TEST_F(Snap, LeavesNothingWhereItCannotWrite) {
  EXPECT_EQ(refused(folder_ / "no such folder" / "a.png").code, ErrorCode::not_found);
  std::filesystem::create_directory(shots_ / "b.png");
  EXPECT_EQ(refused(shots_ / "b.png").code, ErrorCode::refused);
}

// While it lives no file of this process can grow beyond `most_bytes`. Not in a process of its own: a fork
// beside the threads of the fake rigd may inherit a lock that nobody ever releases.
class FullDisk {
 public:
  explicit FullDisk(rlim_t most_bytes) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    signal_before_ = ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{most_bytes, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &before_), 0);
    ::signal(SIGXFSZ, signal_before_);
  }

 private:
  rlimit before_{};
  void (*signal_before_)(int) = nullptr;
};

TEST_F(Snap, LeavesNothingOnAFullDisk) {
  answer_raw();
  test::put_bytes(shots_ / "a.tif", "the one before");
  for (const char* name : {"a.tif", "b.png"}) {
    const auto done = [&] {
      const FullDisk full(200);
      return snap(to_, 20000, shots_ / name);
    }();
    ASSERT_FALSE(done.has_value()) << name;
    EXPECT_EQ(done.error().code, ErrorCode::io) << name;
    answer_.mutable_frame()->clear_raw();
  }
  EXPECT_EQ(test::everything_in(shots_), std::set<std::string>{"a.tif"});
  EXPECT_EQ(test::bytes_in(shots_ / "a.tif"), "the one before");
}

}  // namespace
}  // namespace rig::client
