// A light of two lines, over any DigitalIo.
#include "drivers/common/relay_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>

#include "tests/core/temporary_folder.h"
#include "tests/drivers/common/set_clock.h"

namespace rig::drivers {
namespace {

using base::ErrorCode;
using base::fail;
using ::testing::HasSubstr;

void log_nothing(base::LogLevel /*level*/, std::string_view /*message*/) {}

// What the lines are at, shared with the test.
struct Levels {
  std::map<std::string, bool> active{{"stop", false}, {"lamp", false}, {"shutter", false}};
  bool lost = false;
};

class FakeLines final : public DigitalIo {
 public:
  explicit FakeLines(std::shared_ptr<Levels> levels) : levels_(std::move(levels)) {}
  [[nodiscard]] std::vector<Line> lines() const override {
    return {{"stop", false}, {"lamp", true}, {"shutter", true}};
  }
  [[nodiscard]] Result<std::vector<bool>> read() override {
    if (levels_->lost) return fail(ErrorCode::lost, "gone");
    return std::vector<bool>{levels_->active["stop"], levels_->active["lamp"], levels_->active["shutter"]};
  }
  [[nodiscard]] Result<void> set(const std::string& line, bool active) override {
    if (levels_->lost) return fail(ErrorCode::lost, "gone");
    levels_->active[line] = active;
    return {};
  }

 private:
  const std::shared_ptr<Levels> levels_;
};

class RelayLightTest : public ::testing::Test {
 protected:
  [[nodiscard]] Result<std::unique_ptr<Light>> make(const RelayLightSettings& settings) {
    return make_relay_light(settings, std::make_unique<FakeLines>(levels_), folder_ / "light.hours", clock_,
                            &log_nothing);
  }

  test::TemporaryFolder folder_;
  testing::SetClock clock_;
  std::shared_ptr<Levels> levels_ = std::make_shared<Levels>();
};

TEST_F(RelayLightTest, WithoutAShutterItIsAlwaysOpen) {
  const auto light = make({"lamp", "", 0}).value();
  EXPECT_FALSE(light->capabilities().has_shutter);
  EXPECT_TRUE(light->state().value().shutter_open);
  EXPECT_EQ(light->set_shutter(false).error().code, ErrorCode::refused);
}

TEST_F(RelayLightTest, OnlyOffAndOn) {
  const auto light = make({"lamp", "shutter", 0}).value();
  for (const double level : {0.5, -1.0, 2.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(light->set_level(level).error().code, ErrorCode::bad_input) << level;
  }
  EXPECT_FALSE(levels_->active["lamp"]);
  ASSERT_TRUE(light->set_level(1));
  EXPECT_TRUE(levels_->active["lamp"]);
  ASSERT_TRUE(light->set_level(0));
  EXPECT_FALSE(levels_->active["lamp"]);
}

TEST_F(RelayLightTest, TheStateIsWhatTheLinesRead) {
  const auto light = make({"lamp", "shutter", 0}).value();
  ASSERT_TRUE(light->set_level(1));
  levels_->active["lamp"] = false;  // somebody else
  levels_->active["shutter"] = true;
  const LightState state = light->state().value();
  EXPECT_FALSE(state.on);
  EXPECT_EQ(state.level, 0);
  EXPECT_TRUE(state.shutter_open);
}

TEST_F(RelayLightTest, ItIsWarmAfterItsTimeAndNotAfterItWasLost) {
  const auto light = make({"lamp", "shutter", 300}).value();
  EXPECT_EQ(light->capabilities().warm_up_s, 300);
  ASSERT_TRUE(light->set_level(1));
  EXPECT_FALSE(light->state().value().warm);
  clock_.pass(299);
  EXPECT_FALSE(light->state().value().warm);
  clock_.pass(1);
  EXPECT_TRUE(light->state().value().warm);
  levels_->lost = true;
  EXPECT_EQ(light->state().error().code, ErrorCode::lost);
  levels_->lost = false;
  EXPECT_FALSE(light->state().value().warm);
  clock_.pass(300);
  EXPECT_TRUE(light->state().value().warm);
}

TEST_F(RelayLightTest, HoursOutliveIt) {
  {
    const auto light = make({"lamp", "", 0}).value();
    ASSERT_TRUE(light->set_level(1));
    ASSERT_TRUE(light->state());
    clock_.pass(7200);
    EXPECT_DOUBLE_EQ(light->state().value().hours, 2);
    ASSERT_TRUE(light->set_level(0));
    ASSERT_TRUE(light->state());
  }
  const auto light = make({"lamp", "", 0}).value();
  EXPECT_DOUBLE_EQ(light->state().value().hours, 2);
}

TEST_F(RelayLightTest, LinesThatDoNotExistMakeNoLight) {
  EXPECT_EQ(make({"stop", "", 0}).error().code, ErrorCode::not_found);
  EXPECT_EQ(make({"lamp", "none", 0}).error().code, ErrorCode::not_found);
  test::put_bytes(folder_ / "light.hours", "nonsense");
  EXPECT_EQ(make({"lamp", "", 0}).error().code, ErrorCode::damaged);
}

TEST(RelayLightSettingsTest, MistakesNameTheirKey) {
  const std::vector<Line> lines{{"stop", false}, {"lamp", true}, {"shutter", true}};
  const auto mistakes = [&](const char* text) {
    const auto table = base::ConfigTable::parse(text, "rig.toml").value();
    (void)read_relay_light_settings(table, lines);
    const auto fine = table.finish();
    return fine ? std::string() : fine.error().text();
  };
  EXPECT_EQ(mistakes("relay = 'lamp'\nshutter = 'shutter'\nwarm_up_s = 5"), "");
  EXPECT_THAT(mistakes("relay = 'stop'"), HasSubstr("relay: there is no output 'stop'"));
  EXPECT_THAT(mistakes("relay = 'lamp'\nwarm_up_s = -1"), HasSubstr("warm_up_s"));
  EXPECT_THAT(mistakes("relay = 'lamp'\nshutter = 'lamp'"), HasSubstr("the same line"));
  EXPECT_THAT(mistakes("relay = 'lamp'\nhours = 3"), HasSubstr("unknown key"));
}

}  // namespace
}  // namespace rig::drivers
