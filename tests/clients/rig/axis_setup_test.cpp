// A person's answers, what they make the rig do, and what becomes of rig.toml.
#include "clients/rig/axis_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <unistd.h>

#include "clients/rig/axis_file.h"
#include "core/base/files.h"
#include "core/base/interrupt.h"
#include "tests/clients/rig/fake_rigd.h"
#include "tests/core/temporary_folder.h"

namespace rig::client {
namespace {

using base::ErrorCode;
using protocol::Reply;
using protocol::Request;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

// The virtual rig as shipped, and one whose module has the two keys.
std::string shipped() {
  return *base::read_file(RIG_SOURCE_DIR "/share/virtual/rig.toml");
}
std::string with_keys() {
  std::string text = shipped();
  const std::string header = "[module.settings.axis.pan]\n";
  text.insert(text.find(header) + header.size(), "reversed = false  # as wired\ncounts_per_deg = 100.0\n");
  return text;
}

class AxisSetupTest : public testing::Test {
 protected:
  explicit AxisSetupTest(std::string text = with_keys()) : text_(std::move(text)) {
    test::put_bytes(path_, text_);
    for (const auto& [name, min, max] : {std::tuple{"roll", -180.0, 180.0},
                                         {"tilt", -75.0, 75.0},
                                         {"pan", -90.0, 90.0},
                                         {"arm", 10.0, 175.0}}) {
      auto& axis = *status_.add_axes();
      axis.set_name(name);
      axis.set_min_deg(min);
      axis.set_max_deg(max);
      axis.set_position_deg(name == std::string("pan") ? 5.0 : 45.0);
      axis.set_homed(true);
    }
    status_.set_rig_name("virtual rig");
  }

  // Runs it with these lines as answers; what it printed.
  std::string answered(const std::vector<std::string>& answers) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    std::string lines;
    for (const std::string& answer : answers) lines += answer + "\n";
    EXPECT_EQ(::write(ends[1], lines.data(), lines.size()), static_cast<ssize_t>(lines.size()));
    ::close(ends[1]);
    AxisSetupOptions options;
    options.axis = "pan";
    options.config = path_;
    options.answers = ends[0];
    testing::internal::CaptureStdout();
    result_ = axis_setup(to_, options);
    ::close(ends[0]);
    return testing::internal::GetCapturedStdout();
  }

  [[nodiscard]] std::vector<double> moves() const {
    std::vector<double> out;
    for (const auto& request : rigd_->requests()) {
      if (!request.has_move()) continue;
      EXPECT_EQ(request.move().axes_size(), 1);
      EXPECT_EQ(request.move().axes(0).axis(), "pan");
      out.push_back(request.move().axes(0).angle_deg());
    }
    return out;
  }
  [[nodiscard]] std::vector<double> jogs() const {
    std::vector<double> out;
    for (const auto& request : rigd_->requests()) {
      if (!request.has_jog()) continue;
      EXPECT_EQ(request.jog().axis(), "pan");
      out.push_back(request.jog().by_deg());
    }
    return out;
  }
  [[nodiscard]] std::string now_in_file() const { return test::bytes_in(path_); }
  [[nodiscard]] std::vector<std::string> backups() const {
    std::vector<std::string> out;
    for (const auto& name : test::everything_in(folder_.path())) {
      if (name.starts_with("rig.toml.bak-")) out.push_back(name);
    }
    return out;
  }
  [[nodiscard]] std::string with(const std::string& from, const std::string& to) const {
    std::string text = text_;
    const auto at = text.find(from, text.find("[axis.pan]"));
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  void expect_unchanged() const {
    EXPECT_EQ(now_in_file(), text_);
    EXPECT_THAT(backups(), IsEmpty());
  }

  test::TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "rig.toml";
  const std::string text_;
  protocol::Status status_;
  double home_deg_ = 0;
  double refused_above_deg_ = 1000;  // as a keep-out zone does
  bool can_jog_ = true;
  std::optional<test::FakeRigd> rigd_{
      std::in_place, folder_ / "run", [this](const Request& request, test::FakeRigd&) {
        Reply reply = test::outcome(protocol::DONE);
        auto& pan = *status_.mutable_axes(2);
        if (request.has_move()) {
          if (request.move().axes(0).angle_deg() > refused_above_deg_)
            return test::outcome(protocol::REFUSED, "light and carrier come too near");
          pan.set_position_deg(request.move().axes(0).angle_deg());
        }
        if (request.has_jog()) {
          if (!can_jog_) return test::outcome(protocol::REFUSED, "this drive cannot");
          pan.set_position_deg(pan.position_deg() + request.jog().by_deg());
        }
        if (request.has_home()) {
          for (auto& axis : *status_.mutable_axes()) axis.set_homed(true);
          pan.set_position_deg(home_deg_);
        }
        if (request.has_get_status()) *reply.mutable_status() = status_;
        return reply;
      }};
  Connection to_{rigd_->endpoint(), 60};
  Result<void> result_;
};

TEST_F(AxisSetupTest, WhereAllIsRightNothingChanges) {
  const std::string out = answered({"y", "y", "y", "20", "keep", "keep", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(moves(), ElementsAre(7, 27));
  EXPECT_THAT(out, HasSubstr("the sample's face turns to the right, as the camera sees it"));
  EXPECT_THAT(out, HasSubstr("stands at 0.000 deg: as rig.toml has it"));
  EXPECT_THAT(out, HasSubstr("stays as it is"));
  expect_unchanged();
}

TEST_F(AxisSetupTest, NeverMovesWithoutAYes) {
  (void)answered({"n", "n", "keep", "keep", "n"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  for (const auto& request : rigd_->requests()) EXPECT_TRUE(request.has_get_status());
  expect_unchanged();
}

TEST_F(AxisSetupTest, AWrongDirectionTurnsTheKeyOfTheModuleRound) {
  const std::string out = answered({"", "", "what", "again", "n", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(moves(), ElementsAre(7, 5, 7));
  EXPECT_THAT(out, HasSubstr("-reversed = false  # as wired\n+reversed = true  # as wired\n"));
  EXPECT_THAT(out, HasSubstr("next start of rigd"));
  std::string expected = text_;
  expected.replace(expected.find("reversed = false"), 16, "reversed = true");
  EXPECT_EQ(now_in_file(), expected);
  ASSERT_THAT(backups(), SizeIs(1));
  EXPECT_EQ(test::bytes_in(folder_ / backups()[0]), text_);
}

TEST_F(AxisSetupTest, AWrongScaleChangesTheCounts) {
  status_.mutable_axes(2)->set_position_deg(85);
  // No room to turn on by 20 degrees: it begins at 70. It turned too far, so a degree has more counts...
  // fewer.
  const std::string out = answered({"n", "y", "", "-3", "much", "25", "y", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(moves(), ElementsAre(70, 90));
  EXPECT_THAT(out, HasSubstr("a positive number, please"));
  EXPECT_THAT(now_in_file(), HasSubstr("counts_per_deg = 80.0\n"));
}

TEST_F(AxisSetupTest, AMeasurementThatIsNotTrustedChangesNothing) {
  (void)answered({"n", "y", "20.1", "n", "keep", "keep", "n"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  expect_unchanged();
}

TEST_F(AxisSetupTest, LimitsAreWhereThePersonSays) {
  const std::string out = answered({"n", "n", "", "", "-2.5", "here", "30.004", "here", "n", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(moves(), ElementsAre(0, -5, -2.5, testing::DoubleEq(27.504)));
  EXPECT_EQ(now_in_file(), with("min_deg = -90.0\nmax_deg = 90.0\n", "min_deg = -2.5\nmax_deg = 27.5\n"));
}

TEST_F(AxisSetupTest, ALimitMayBeNamedBeyondThePresentOne) {
  const std::string out = answered({"n", "n", "200", "5", "= -92.5", "", "= nowhere", "keep", "n", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(moves(), ElementsAre(-90, -85)) << "never beyond rigd's own limit";
  EXPECT_THAT(out, HasSubstr("rigd goes no further than -90 deg"));
  EXPECT_THAT(out, HasSubstr("a number, here, = ANGLE or keep, please"));
  EXPECT_EQ(now_in_file(), with("min_deg = -90.0", "min_deg = -92.5"));
}

TEST_F(AxisSetupTest, WhatRigdRefusesIsToldAndCanBeAskedDifferently) {
  refused_above_deg_ = 20;
  const std::string out = answered({"n", "n", "keep", "30", "10", "here", "n", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(out, HasSubstr("refused: light and carrier come too near"));
  EXPECT_EQ(now_in_file(), with("max_deg = 90.0", "max_deg = 15.0"));
}

TEST_F(AxisSetupTest, HomingElsewhereIsFound) {
  home_deg_ = 1.234;
  (void)answered({"n", "n", "keep", "keep", "y", "y", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_EQ(now_in_file(), with("home_deg = 0.0", "home_deg = 1.23"));
}

TEST_F(AxisSetupTest, AFileThatWouldBeWrongIsNotWritten) {
  // Home would lie outside.
  const std::string out = answered({"n", "n", "= 3", "keep", "n", "y"});
  ASSERT_FALSE(result_.has_value());
  EXPECT_THAT(result_.error().text(), HasSubstr("axis.pan.home_deg: lies outside the limits"));
  EXPECT_THAT(out, HasSubstr("+min_deg = 3.0"));
  expect_unchanged();
}

TEST_F(AxisSetupTest, ANoAtTheEndChangesNothing) {
  const std::string out = answered({"n", "n", "= -80", "keep", "n", ""});
  EXPECT_TRUE(result_.has_value());
  EXPECT_THAT(out, HasSubstr("Nothing was changed."));
  expect_unchanged();
}

TEST_F(AxisSetupTest, AnswersThatEndChangeNothing) {
  for (const std::vector<std::string>& answers : {std::vector<std::string>{}, {"y"}, {"n", "n", "= -80"}}) {
    (void)answered(answers);
    ASSERT_FALSE(result_.has_value());
    EXPECT_THAT(result_.error().text(), HasSubstr("the answers ended"));
  }
  expect_unchanged();
}

TEST_F(AxisSetupTest, AnInterruptStopsTheMovementAndChangesNothing) {
  rigd_.reset();  // a child must not be forked beside its threads
  const auto status = test::in_child([this] {
    base::catch_interrupts();
    bool stopped = false;
    const test::FakeRigd rigd(folder_ / "other", [&](const Request& request, test::FakeRigd&) {
      std::optional<Reply> reply = test::outcome(protocol::DONE);
      if (request.has_get_status()) *reply->mutable_status() = status_;
      stopped = stopped || request.has_stop();
      // A move is answered at its end.
      if (request.has_move()) {
        reply.reset();
        ::kill(::getpid(), SIGINT);
      }
      return reply;
    });
    to_.endpoint = rigd.endpoint();
    (void)answered({"y", "y"});
    return !result_ && result_.error().code == ErrorCode::interrupted && stopped ? 0 : 1;
  });
  EXPECT_EQ(status, 0);
  expect_unchanged();
}

TEST_F(AxisSetupTest, HomesFirstIfThePersonAgrees) {
  status_.mutable_axes(2)->set_homed(false);
  status_.mutable_axes(3)->set_homed(false);
  const std::string refused = answered({"n", "n"});
  EXPECT_THAT(refused, HasSubstr("not yet: pan, arm. Home all now"));
  ASSERT_FALSE(result_.has_value());
  EXPECT_EQ(result_.error().code, ErrorCode::refused);
  EXPECT_THAT(moves(), IsEmpty());
  EXPECT_THAT(jogs(), IsEmpty());
  (void)answered({"n", "y", "n", "n", "keep", "keep", "n"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_TRUE(status_.axes(2).homed());
}

TEST_F(AxisSetupTest, ShowsTheDirectionBeforeHoming) {
  status_.mutable_axes(2)->set_homed(false);
  // Once it was seen it is not asked for a second time.
  const std::string out = answered({"", "again", "y", "y", "n", "keep", "keep", "n"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(jogs(), ElementsAre(2, -2, 2));
  EXPECT_THAT(moves(), IsEmpty());
  EXPECT_THAT(out, HasSubstr("keeps no limits"));
  EXPECT_TRUE(status_.axes(2).homed());
  expect_unchanged();
}

TEST_F(AxisSetupTest, AWrongDirectionIsTurnedRoundBeforeItIsHomed) {
  status_.mutable_axes(2)->set_homed(false);
  const std::string out = answered({"y", "n", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(now_in_file(), HasSubstr("reversed = true"));
  EXPECT_FALSE(status_.axes(2).homed()) << "homing would run into the wrong end";
}

TEST_F(AxisSetupTest, ADriveThatCannotMoveBeforeHomingIsHomedFirst) {
  status_.mutable_axes(2)->set_homed(false);
  can_jog_ = false;
  const std::string out = answered({"y", "y", "y", "y", "n", "keep", "keep", "n"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text() << out;
  EXPECT_THAT(out, HasSubstr("refused: this drive cannot"));
  EXPECT_THAT(moves(), ElementsAre(2)) << "the direction is shown once it is homed";
}

TEST_F(AxisSetupTest, TheFileMustBeTheOneThatRigdRunsWith) {
  status_.mutable_axes(2)->set_max_deg(80);
  (void)answered({});
  ASSERT_FALSE(result_.has_value());
  EXPECT_THAT(result_.error().text(), HasSubstr("another rig.toml"));
  status_.mutable_axes(2)->set_max_deg(90);
  status_.set_rig_name("another");
  (void)answered({});
  EXPECT_THAT(result_.error().text(), HasSubstr("another rig.toml"));
}

TEST_F(AxisSetupTest, SomebodyElsesChangeIsNotOverwritten) {
  ASSERT_TRUE(replace_keeping_old(path_, text_, "first").has_value());
  const auto second = replace_keeping_old(path_, text_, "second");
  ASSERT_FALSE(second.has_value());
  EXPECT_THAT(second.error().text(), HasSubstr("changed it meanwhile"));
  EXPECT_EQ(now_in_file(), "first");
}

TEST_F(AxisSetupTest, NoBackupTakesThePlaceOfAnother) {
  std::string before = text_;
  for (int i = 0; i < 5; ++i) {
    const std::string after = std::to_string(i);
    const auto old = replace_keeping_old(path_, before, after);
    ASSERT_TRUE(old.has_value()) << old.error().text();
    EXPECT_EQ(test::bytes_in(*old), before);
    before = after;
  }
  EXPECT_THAT(backups(), SizeIs(5));
}

TEST_F(AxisSetupTest, PermissionsAndLinksStay) {
  namespace fs = std::filesystem;
  const auto mode = fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read;
  fs::permissions(path_, mode);
  fs::create_symlink(path_, folder_ / "link.toml");
  ASSERT_TRUE(replace_keeping_old(folder_ / "link.toml", text_, "new").has_value());
  EXPECT_EQ(now_in_file(), "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.toml"));
  EXPECT_EQ(fs::status(path_).permissions(), mode);
}

class WithLimitLines : public AxisSetupTest {
 protected:
  WithLimitLines()
      : AxisSetupTest(with_keys() +
                      "\n[lines.limit.pan.high]\nmodule = \"virtual\"\ndevice = \"lines\"\nline = "
                      "\"pan_high\"\n\n[lines.limit.arm.low]\nmodule = \"virtual\"\ndevice = \"lines\"\n"
                      "line = \"arm_low\"\n") {}
};

TEST_F(WithLimitLines, AreShownAndChangePlacesWithTheDirection) {
  status_.mutable_axes(2)->set_at_high_limit(true);
  const std::string shown = answered({"n", "n", "keep", "keep", "n"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_THAT(shown, HasSubstr("limit line 'pan_high', device 'lines' of module 'virtual'"));
  EXPECT_THAT(shown, HasSubstr("homed, on its high limit switch"));
  EXPECT_THAT(shown, Not(HasSubstr("arm_low")));
  EXPECT_THAT(shown, Not(HasSubstr("exchange")));
  const std::string turned = answered({"", "", "n", "y"});
  ASSERT_TRUE(result_.has_value()) << result_.error().text();
  EXPECT_THAT(turned, HasSubstr("By hand: The limit lines of pan change places with the direction: exchange "
                                "[lines.limit.pan.low] and [lines.limit.pan.high] before"));
}

class WithoutKeys : public AxisSetupTest {
 protected:
  WithoutKeys() : AxisSetupTest(shipped()) {}
};

TEST_F(WithoutKeys, WhatNoKeySetsIsToldToThePerson) {
  const std::string turned = answered({"y", "n"});
  EXPECT_TRUE(result_.has_value());
  EXPECT_THAT(turned, HasSubstr("By hand: Turn the direction of pan round"));
  const std::string scaled = answered({"n", "y", "25", "y"});
  EXPECT_TRUE(result_.has_value());
  EXPECT_THAT(scaled, HasSubstr("By hand: Multiply the counts per degree of pan by 0.8 "));
  EXPECT_THAT(scaled, Not(HasSubstr("Write that")));
  expect_unchanged();
}

TEST(AxisFile, NamesAxesThatThereAre) {
  const auto file = read_axis_file(shipped(), "rig.toml", "yaw");
  ASSERT_FALSE(file.has_value());
  EXPECT_EQ(file.error().text(), "there is no axis 'yaw' (roll, tilt, pan or arm)");
}

TEST(AxisFile, RefusesKeysOfAnotherKind) {
  std::string text = with_keys();
  text.replace(text.find("reversed = false"), 16, "reversed = 'yes'");
  const auto file = read_axis_file(text, "rig.toml", "pan");
  ASSERT_FALSE(file.has_value());
  EXPECT_THAT(file.error().text(), HasSubstr("reversed: must be true or false"));
}

}  // namespace
}  // namespace rig::client
