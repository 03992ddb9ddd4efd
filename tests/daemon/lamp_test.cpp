// A lamp that has to cool down, and a light without a shutter.
#include "daemon/lamp.h"

#include <gmock/gmock.h>

#include "tests/daemon/job_fixture.h"

namespace rig::daemon::testing {
namespace {

using ::testing::HasSubstr;

class LampTest : public JobTest {
 protected:
  LampTest() {
    setup_.rig.light.cool_down_s = 300;
    restart();
  }
  // When the lamp was lit, and when rigd began.
  double lit_after_s() {
    const auto begin = model_->now();
    run_until([&] { return !actions<SetLightLevel>().empty(); });
    return base::to_seconds(model_->now() - begin);
  }
};

TEST_F(LampTest, OneThatIsOutWhenRigdStartsIsNotLitBeforeItHasCooledDown) {
  add_job(small_job(1));
  EXPECT_NEAR(lit_after_s(), 300, 5);
  run_to_completion();
}

TEST_F(LampTest, AClientCannotLightItEither) {
  run_for(5);
  protocol::Request light;
  light.mutable_set_light()->set_on(true);
  const auto& reply = ask(light);
  EXPECT_EQ(reply.outcome(), protocol::REFUSED);
  EXPECT_THAT(reply.reason(), HasSubstr("cool down"));
  run_for(300);
  EXPECT_EQ(ask(light).outcome(), protocol::DONE);
}

TEST_F(LampTest, OneThatBurnsNeedsNoCoolingDown) {
  run_for(310);
  protocol::Request light;
  light.mutable_set_light()->set_on(true);
  ASSERT_EQ(ask(light).outcome(), protocol::DONE);
  run_for(5);
  EXPECT_EQ(cool_down_left_s(setup_, model_->state()), 0);
  add_job(small_job(1));
  run_to_completion();
}

TEST_F(LampTest, ALightWithoutAShutterGoesToItsSafeLevelOnAStop) {
  setup_.light.has_shutter = false;
  setup_.rig.light.safe_level = 0;
  Actions actions;
  make_light_safe(setup_, actions);
  ASSERT_EQ(actions.size(), 1U);
  EXPECT_EQ(std::get<SetLightLevel>(actions[0]).level, 0);
  setup_.rig.light.safe_level = 0.1;
  actions.clear();
  make_light_safe(setup_, actions);
  EXPECT_EQ(std::get<SetLightLevel>(actions[0]).level, 0.1);
}

}  // namespace
}  // namespace rig::daemon::testing
