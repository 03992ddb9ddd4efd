// Control of the rig: one client has it, everybody sees who, and nobody keeps it who is gone.
#include "daemon/lease.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "daemon/step.h"
#include "tests/core/seed.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {
namespace {

using base::seconds;
using protocol::Request;
using protocol::Role;
using ::testing::HasSubstr;

Request light_up() {
  Request request;
  request.mutable_set_light()->set_level(1);
  return request;
}
Request take_control() {
  Request request;
  request.mutable_take_control();
  return request;
}
Request release_control() {
  Request request;
  request.mutable_release_control();
  return request;
}
Request hand_over(const std::string& client) {
  Request request;
  request.mutable_hand_over()->set_client(client);
  return request;
}
Request look() {
  Request request;
  request.mutable_get_status();
  return request;
}

class LeaseTest : public ::testing::Test {
 protected:
  LeaseTest() {
    for (auto& axis : state_.axes) {
      axis.known = true;
      axis.last.homed = true;
    }
  }

  // What step() answers; the actions of the step stay in actions_.
  protocol::Reply ask(const std::string& who, Role role, Request request) {
    request.set_id(++last_id_);
    happens(RequestReceived{{1, who}, role, std::move(request), who});
    protocol::Reply found;
    for (const Action& action : actions_) {
      const auto* reply = std::get_if<SendReply>(&action);
      if (reply != nullptr && reply->reply.id() == last_id_) found = reply->reply;
    }
    return found;
  }
  protocol::Outcome outcome(const std::string& who, Role role, const Request& request) {
    return ask(who, role, request).outcome();
  }
  void happens(What what) {
    Step next = step(setup_, std::move(state_), Event{wall_, std::move(what), wall_});
    state_ = std::move(next.state);
    actions_ = std::move(next.actions);
    for (const Action& action : actions_) {
      const auto* told = std::get_if<Publish>(&action);
      if (told != nullptr && told->event.has_control_changed())
        changes_.push_back(told->event.control_changed());
    }
  }
  void passes(double duration_s) {
    wall_ += seconds(duration_s);
    happens(Tick{});
  }
  [[nodiscard]] bool acted() const {
    return std::any_of(actions_.begin(), actions_.end(),
                       [](const Action& action) { return std::holds_alternative<SetLightLevel>(action); });
  }
  [[nodiscard]] const std::string& holder() const { return state_.lease.holder; }

  const daemon::Setup setup_ = small_setup();
  const double limit_s_ = setup_.rig.access.release_after_s;
  State state_;
  base::Time wall_{seconds(1e9)};
  Actions actions_;
  std::vector<protocol::ControlChanged> changes_;
  std::uint64_t last_id_ = 0;
};

TEST_F(LeaseTest, AFirstCommandTakesFreeControlVisibly) {
  EXPECT_EQ(outcome("anna", Role::operator_, light_up()), protocol::DONE);
  EXPECT_TRUE(acted());
  EXPECT_EQ(holder(), "anna");
  ASSERT_EQ(changes_.size(), 1U);
  EXPECT_EQ(changes_[0].holder(), "anna");
  EXPECT_EQ(changes_[0].previous(), "");
  const auto status = ask("ben", Role::observer, look()).status();
  EXPECT_EQ(status.control().holder(), "anna");
  EXPECT_EQ(status.control().clients_size(), 2);
}

TEST_F(LeaseTest, IsRememberedBeforeTheAnswer) {
  EXPECT_EQ(outcome("anna", Role::operator_, light_up()), protocol::DONE);
  bool saved = false;
  for (const Action& action : actions_) {
    if (const auto* save = std::get_if<SaveLease>(&action)) saved = save->holder == "anna";
    if (std::holds_alternative<SendReply>(action)) {
      EXPECT_TRUE(saved);
    }
  }
  EXPECT_TRUE(saved);
}

TEST_F(LeaseTest, AnothersCommandIsRefusedAndDoesNothing) {
  ask("anna", Role::operator_, light_up());
  for (const Role role : {Role::operator_, Role::admin}) {
    const auto reply = ask("ben", role, light_up());
    EXPECT_EQ(reply.outcome(), protocol::REFUSED);
    EXPECT_THAT(reply.reason(), HasSubstr("'anna' holds control"));
    EXPECT_FALSE(acted());
  }
  EXPECT_EQ(holder(), "anna");
}

TEST_F(LeaseTest, StoppingNeedsNoControl) {
  ask("anna", Role::operator_, light_up());
  Request stop;
  stop.mutable_stop();
  EXPECT_EQ(outcome("ben", Role::observer, stop), protocol::DONE);
  EXPECT_FALSE(state_.stopped.empty());
  EXPECT_EQ(holder(), "anna") << "nor does it take any";
  Request clear;
  clear.mutable_clear_stop();
  EXPECT_EQ(outcome("ben", Role::operator_, clear), protocol::REFUSED);
  EXPECT_EQ(outcome("anna", Role::operator_, clear), protocol::DONE);
}

TEST_F(LeaseTest, LookingTakesNoControl) {
  EXPECT_EQ(outcome("anna", Role::operator_, look()), protocol::DONE);
  Request asks;
  asks.mutable_get_control();
  const auto reply = ask("ben", Role::observer, asks);
  EXPECT_EQ(reply.outcome(), protocol::DONE);
  EXPECT_EQ(reply.control().you(), "ben");
  EXPECT_EQ(holder(), "");
}

TEST_F(LeaseTest, AnObserverNeverGetsControl) {
  EXPECT_EQ(outcome("ben", Role::observer, take_control()), protocol::REFUSED);
  EXPECT_EQ(outcome("ben", Role::observer, light_up()), protocol::REFUSED);
  EXPECT_EQ(holder(), "");
  ask("anna", Role::operator_, light_up());
  ask("ben", Role::observer, look());
  EXPECT_EQ(outcome("anna", Role::operator_, hand_over("ben")), protocol::REFUSED);
  EXPECT_EQ(outcome("anna", Role::observer, release_control()), protocol::REFUSED);
  EXPECT_EQ(holder(), "anna");
}

TEST_F(LeaseTest, IsHandedOverToOneWhoIsThere) {
  ask("anna", Role::operator_, take_control());
  EXPECT_EQ(outcome("anna", Role::operator_, hand_over("ben")), protocol::REFUSED) << "never heard of";
  ask("ben", Role::operator_, look());
  EXPECT_EQ(outcome("ben", Role::operator_, hand_over("ben")), protocol::REFUSED) << "not his to give";
  EXPECT_EQ(outcome("anna", Role::operator_, hand_over("ben")), protocol::DONE);
  EXPECT_EQ(holder(), "ben");
  EXPECT_EQ(outcome("anna", Role::operator_, light_up()), protocol::REFUSED);
  EXPECT_EQ(outcome("ben", Role::operator_, light_up()), protocol::DONE);
}

TEST_F(LeaseTest, IsReleasedByItsHolder) {
  ask("anna", Role::operator_, take_control());
  EXPECT_EQ(outcome("ben", Role::operator_, release_control()), protocol::REFUSED);
  EXPECT_EQ(outcome("anna", Role::operator_, release_control()), protocol::DONE);
  EXPECT_EQ(holder(), "");
  EXPECT_EQ(outcome("anna", Role::operator_, release_control()), protocol::REFUSED) << "nobody has it";
  EXPECT_EQ(outcome("ben", Role::operator_, light_up()), protocol::DONE);
}

TEST_F(LeaseTest, AnAdminTakesItAnOperatorDoesNot) {
  ask("anna", Role::operator_, take_control());
  EXPECT_EQ(outcome("ben", Role::operator_, take_control()), protocol::REFUSED);
  EXPECT_EQ(holder(), "anna");
  EXPECT_EQ(outcome("chief", Role::admin, take_control()), protocol::DONE);
  EXPECT_EQ(holder(), "chief");
  EXPECT_EQ(changes_.back().previous(), "anna");
  EXPECT_EQ(outcome("anna", Role::operator_, light_up()), protocol::REFUSED);
}

TEST_F(LeaseTest, AVanishedHolderLosesItAfterTheStatedTime) {
  ask("anna", Role::operator_, take_control());
  passes(limit_s_ - 1);
  EXPECT_EQ(holder(), "anna");
  ask("anna", Role::operator_, look());  // any request is a sign of life
  passes(limit_s_ - 1);
  EXPECT_EQ(holder(), "anna");
  EXPECT_EQ(outcome("ben", Role::operator_, light_up()), protocol::REFUSED);
  passes(2);
  EXPECT_EQ(holder(), "");
  EXPECT_THAT(changes_.back().reason(), HasSubstr("not heard of"));
  EXPECT_EQ(outcome("ben", Role::operator_, light_up()), protocol::DONE);
  EXPECT_EQ(outcome("anna", Role::operator_, light_up()), protocol::REFUSED) << "too late";
}

TEST_F(LeaseTest, WhoComesBackTooLateHasLostItEvenWhereNothingElseHappened) {
  ask("anna", Role::operator_, take_control());
  wall_ += seconds(limit_s_ + 1);
  ask("anna", Role::operator_, look());
  EXPECT_EQ(holder(), "");
}

TEST_F(LeaseTest, WhoWaitsForAnAnswerHasNotVanished) {
  Request snap;
  snap.mutable_snap()->set_exposure_us(20000);
  ask("anna", Role::operator_, snap);
  ASSERT_TRUE(state_.snap.has_value());
  // The rig's own clock stands still meanwhile: the camera is not late.
  for (int i = 0; i < 3; ++i) {
    wall_ += seconds(limit_s_);
    Step next = step(setup_, std::move(state_), Event{base::Time{seconds(1e9)}, Tick{}, wall_});
    state_ = std::move(next.state);
    EXPECT_EQ(holder(), "anna");
  }
}

TEST_F(LeaseTest, AfterARestartTheHolderHasTheFullTimeToComeBack) {
  state_.lease.holder = "anna";
  passes(0);
  EXPECT_EQ(outcome("ben", Role::operator_, light_up()), protocol::REFUSED);
  passes(limit_s_ - 1);
  EXPECT_EQ(holder(), "anna");
  passes(2);
  EXPECT_EQ(holder(), "");
}

TEST_F(LeaseTest, ARevokedClientLosesIt) {
  ask("anna", Role::operator_, take_control());
  happens(ClientRevoked{"ben"});
  EXPECT_EQ(holder(), "anna");
  happens(ClientRevoked{"anna"});
  EXPECT_EQ(holder(), "");
  EXPECT_TRUE(state_.lease.present.empty());
}

// Whatever clients do and whenever: only the holder's commands act, every change is told and follows on the
// one before, and no holder has been silent for longer than the limit.
TEST_F(LeaseTest, OnlyTheHolderEverCommands) {
  base::Random random(test::seed(51));
  const std::vector<std::string> names{"anna", "ben", "chief"};
  int acted_times = 0;
  for (int i = 0; i < 30'000; ++i) {
    const std::string& who = names[random.below(names.size())];
    const Role role = random.below(4) == 0 ? Role::observer : who == "chief" ? Role::admin : Role::operator_;
    const std::vector<Request> requests{light_up(),        light_up(), take_control(),
                                        release_control(), look(),     hand_over(names[random.below(3)])};
    const std::size_t told = changes_.size();
    const std::string before = holder();
    wall_ += seconds(random.below(10) == 0 ? random.uniform(0, 2 * limit_s_) : random.uniform(0, 2));
    const bool revokes = random.below(50) == 0;
    if (revokes) {
      happens(ClientRevoked{who});
      ASSERT_NE(holder(), who);
    } else {
      ASSERT_NE(outcome(who, role, requests[random.below(requests.size())]), protocol::OUTCOME_UNSPECIFIED);
    }
    if (acted()) {
      ++acted_times;
      ASSERT_EQ(holder(), who);
      ASSERT_NE(role, Role::observer);
    }
    std::string last = before;
    for (std::size_t n = told; n < changes_.size(); ++n) {
      ASSERT_EQ(changes_[n].previous(), last);
      last = changes_[n].holder();
    }
    ASSERT_EQ(last, holder());
    if (!holder().empty()) {
      ASSERT_LE(base::to_seconds(wall_ - state_.lease.present.at(holder()).heard), limit_s_);
    }
  }
  EXPECT_GT(acted_times, 1000);
}

}  // namespace
}  // namespace rig::daemon::testing
