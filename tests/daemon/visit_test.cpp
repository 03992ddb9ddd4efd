// Reference visits, the check of the sample's place, and the sample's identity.
#include <gmock/gmock.h>

#include "daemon/visit_standard.h"
#include "tests/daemon/job_fixture.h"

namespace rig::daemon::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class VisitTest : public JobTest {
 protected:
  VisitTest() {
    setup_.rig.unattended.reference = some_reference();
    restart();
  }
  [[nodiscard]] std::vector<protocol::ReferenceVisited> visits() const {
    std::vector<protocol::ReferenceVisited> all;
    for (const auto& event : model_->events()) {
      if (event.has_reference_visited()) all.push_back(event.reference_visited());
    }
    return all;
  }
  [[nodiscard]] std::size_t commits() const {
    std::size_t count = 0;
    for (const auto& event : model_->events()) count += event.has_pose_committed() ? 1U : 0U;
    return count;
  }
};

TEST_F(VisitTest, AreMadeAtTheStartOnScheduleAndAtTheEnd) {
  add_job(small_job(5));
  run_to_completion();
  // Twice before the first pose, after two, after four, and for the fifth.
  ASSERT_EQ(visits().size(), 5U);
  EXPECT_FALSE(visits()[0].good()) << "there is nothing that it agrees with";
  for (const auto& visit : visits()) {
    EXPECT_EQ(visit.good(), visit.visit() > 0);
    EXPECT_EQ(visit.what(), "");
  }
  EXPECT_EQ(commits(), 5U);
  EXPECT_THAT(suspensions(), IsEmpty());
}

TEST_F(VisitTest, TakeADarkFrameWithTheShutterShutAndOneOfThePatches) {
  add_job(small_job(1));
  run_to_completion();
  const auto looks = actions<JudgeLook>();
  ASSERT_EQ(looks.size(), 6U);
  EXPECT_EQ(looks[0].name, "dark");
  EXPECT_EQ(looks[1].name, "patches");
  EXPECT_DOUBLE_EQ(looks[0].info.exposure_s, some_reference().dark_exposure_s);
  EXPECT_DOUBLE_EQ(looks[1].info.exposure_s, some_reference().exposure_s);
}

TEST_F(VisitTest, TakeAFlatAtItsOwnPose) {
  const machine::FlatConfig flat = some_flat();
  setup_.rig.unattended.reference->flat = flat;
  restart();
  add_job(small_job(1));
  run_to_completion();
  const auto looks = actions<JudgeLook>();
  ASSERT_EQ(looks.size(), 9U);
  for (const std::size_t first : {0U, 3U, 6U}) {
    EXPECT_EQ(looks[first].name, "dark");
    EXPECT_EQ(looks[first + 1].name, "patches");
    EXPECT_EQ(looks[first + 2].name, "flat");
    EXPECT_DOUBLE_EQ(looks[first + 2].info.exposure_s, flat.exposure_s);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      EXPECT_NEAR(looks[first + 1].readback_rad[i], some_reference().pose_rad[i], 1e-3);
      EXPECT_NEAR(looks[first + 2].readback_rad[i], flat.pose_rad[i], 1e-3);
    }
  }
  ASSERT_EQ(visits().size(), 3U);
  EXPECT_EQ(visits()[0].flat_level(), 0) << "nothing to compare with";
  EXPECT_DOUBLE_EQ(visits()[1].flat_level(), 1);
  EXPECT_DOUBLE_EQ(visits()[2].flat_level(), 1);
}

TEST_F(VisitTest, AFlatThatIsNotAsItWasSuspendsTheJob) {
  setup_.rig.unattended.reference->flat = some_flat();
  restart();
  add_job(small_job(5));
  run_until([&] { return commits() == 2; });
  model_->flat_dn[5] = 1800;  // one part of it: a shadow
  run_until([&] { return !suspensions().empty(); });
  EXPECT_THAT(suspensions(), ElementsAre("+reference"));
  EXPECT_THAT(visits().back().what(), HasSubstr("the light is uneven: a part of the flat departs by"));
  EXPECT_EQ(visits().back().poses_again(), 2U);
  model_->flat_dn[5] = 2000;
  run_to_completion();
  EXPECT_EQ(entry().done, 5);
}

TEST_F(VisitTest, ABadOneSuspendsTheJobAndQueuesThePosesSinceTheLastGoodOneAgain) {
  add_job(small_job(5));
  run_until([&] { return commits() == 2; });
  model_->patch_dn = 900;
  run_until([&] { return !suspensions().empty(); });
  EXPECT_THAT(suspensions(), ElementsAre("+reference"));
  ASSERT_FALSE(visits().back().good());
  EXPECT_EQ(visits().back().poses_again(), 2U);
  EXPECT_THAT(visits().back().what(), HasSubstr("0.9000 of their first radiance"));
  EXPECT_EQ(entry().done, 0);
  model_->patch_dn = 1000;
  run_to_completion();
  EXPECT_THAT(suspensions(), ElementsAre("+reference", "-reference"));
  EXPECT_EQ(commits(), 7U);
  EXPECT_EQ(entry().done, 5);
}

TEST_F(VisitTest, ADoorThatIsOpenShowsInTheDarkFrame) {
  add_job(small_job(5));
  run_until([&] { return commits() == 2; });
  model_->dark_dn = 5;
  run_until([&] { return !suspensions().empty(); });
  EXPECT_THAT(suspensions(), ElementsAre("+room not dark"));
  EXPECT_THAT(visits().back().what(), HasSubstr("the room is not dark"));
  model_->dark_dn = 0;
  run_to_completion();
}

TEST_F(VisitTest, ThreeBadOnesWaitForAPerson) {
  add_job(small_job(5));
  run_until([&] { return commits() == 3; });
  model_->patch_dn = 900;
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_EQ(visits().size(), 6U);  // the first three found nothing wrong
  EXPECT_EQ(entry().done, 2);
  model_->patch_dn = 1000;
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(entry().done, 5);
}

TEST_F(VisitTest, ALastPoseThatIsAbandonedLeavesThoseBeforeItToBeProven) {
  add_job(small_job(2));
  run_until([&] { return actions<TriggerCamera>().size() == 5; });  // two visits, then the first pose
  model_->on_high_switch[0] = true;                                 // the way to the second
  run_until([&] { return entry().abandoned == 1; });
  model_->on_high_switch[0] = false;
  run_to_completion();
  EXPECT_EQ(commits(), 1U);
  ASSERT_EQ(visits().size(), 3U);
  EXPECT_TRUE(visits()[2].good()) << visits()[2].what();
}

TEST_F(VisitTest, PosesThatTheLastOneGivesBackWaitAsTheJobDoes) {
  add_job(small_job(1));
  run_until([&] { return actions<TriggerCamera>().size() == 5; });
  ASSERT_EQ(hold(1, "by hand").outcome(), protocol::DONE);
  model_->patch_dn = 900;
  run_until([&] { return visits().size() == 3; });
  EXPECT_EQ(visits()[2].poses_again(), 1U);
  model_->patch_dn = 1000;
  run_for(3 * some_reference().again_s);
  EXPECT_EQ(commits(), 1U) << "a pose was taken while the job is held";
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(commits(), 2U);
  EXPECT_EQ(entry().done, 1);
}

TEST_F(VisitTest, WhereNoPoseDependsOnItAnotherLightIsBegunWith) {
  add_job(small_job(3));
  run_until([&] { return commits() == 2; });
  model_->patch_dn = 900;  // both poses are taken again, and with them the comparison
  run_to_completion();
  EXPECT_THAT(suspensions(), ElementsAre("+reference", "-reference"));
}

TEST_F(VisitTest, WithoutAShutterThereIsNoDarkFrame) {
  setup_.light.has_shutter = false;
  restart();
  add_job(small_job(1));
  run_to_completion();
  for (const auto& look : actions<JudgeLook>()) EXPECT_EQ(look.name, "patches");
}

TEST_F(VisitTest, AStopInTheMiddleOfOneMakesItAgain) {
  add_job(small_job(1));
  run_until([&] { return model_->state().job && model_->state().job->visit; });
  protocol::Request stop;
  stop.mutable_stop();
  ask(stop);
  protocol::Request clear;
  clear.mutable_clear_stop();
  ask(clear);
  run_to_completion();
  EXPECT_EQ(visits().size(), 3U);
}

TEST_F(VisitTest, AnExcursionOnTheVeryFirstOneIsFoundBeforeAnyPose) {
  model_->patch_dn = 800;
  add_job(small_job(5));
  run_until([&] { return visits().size() == 1; });
  model_->patch_dn = 1000;
  run_until([&] { return !suspensions().empty(); });
  EXPECT_THAT(suspensions(), ElementsAre("+reference"));
  EXPECT_THAT(visits().back().what(), HasSubstr("it does not agree with the visit before: "));
  EXPECT_EQ(commits(), 0U);
  run_to_completion();
  EXPECT_THAT(suspensions(), ElementsAre("+reference", "-reference"));
  EXPECT_EQ(commits(), 5U) << "no pose was taken twice";
  // The excursion's, the one that did not agree, and the five of an undisturbed night without its first.
  EXPECT_EQ(visits().size(), 6U);
  for (const auto& visit : visits()) {
    EXPECT_EQ(visit.good(), visit.visit() >= 2);
    if (visit.good()) {
      EXPECT_DOUBLE_EQ(visit.level(), 1);
    }
  }
}

TEST_F(VisitTest, ALightThatNeverAgreesWithItselfWaitsForAPerson) {
  double level = 1000;
  add_job(small_job(5));
  run_until([&] {
    if (const auto looks = actions<RecordVisit>(); !looks.empty())
      level = 1000 + 100 * static_cast<double>(looks.size());
    model_->patch_dn = level;
    return !entry().hold.empty();
  });
  EXPECT_EQ(commits(), 0U);
  EXPECT_EQ(visits().size(), 4U);
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(commits(), 5U);
}

// Both visits of the beginning fall into one excursion, and so does the one that proves the first poses.
TEST_F(VisitTest, AStandardOfBadLightIsGivenUpAndEveryPoseTakenAgain) {
  setup_.rig.unattended.reference->attempts = 5;
  restart();
  model_->patch_dn = 800;
  add_job(small_job(5));
  run_until([&] { return visits().size() == 3 && commits() == 3; });
  model_->patch_dn = 1000;
  run_until([&] { return visits().back().good() && !visits().back().what().empty(); });
  const auto found = visits().back();
  // Two visits agreed with the standard, and the one that founded it; four do not.
  EXPECT_EQ(found.visit(), 6);
  EXPECT_EQ(found.poses_again(), 2U);
  EXPECT_THAT(found.what(), HasSubstr("4 visits agree with each other and not with the first"));
  EXPECT_EQ(entry().done, 0);
  run_to_completion();
  EXPECT_EQ(entry().done, 5);
  EXPECT_DOUBLE_EQ(visits().back().level(), 1);
  EXPECT_TRUE(entry().hold.empty());
}

TEST_F(VisitTest, AStandardThatManyVisitsAgreedWithIsLeftToAPerson) {
  add_job(small_job(5));
  run_until([&] { return commits() == 4 && visits().size() == 4; });
  model_->patch_dn = 800;
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_GT(entry().done, 0) << "what is proven stays";
  model_->patch_dn = 1000;
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
}

// Somebody switched the light of the room on and leaves it.
TEST_F(VisitTest, ARoomThatIsNotDarkNeverBecomesTheStandard) {
  add_job(small_job(5));
  run_until([&] { return commits() == 2; });
  model_->dark_dn = 50;
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_THAT(entry().hold, HasSubstr("the room is not dark"));
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_until([&] { return entry().hold.empty(); });
  run_until([&] { return !entry().hold.empty(); });
  model_->dark_dn = 0;
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
}

TEST_F(VisitTest, OneThatTheKeepOutZonesForbidIsPutOff) {
  auto reference = some_reference();
  reference.pose_rad = {0, base::radians(85.0), 0, base::radians(60.0)};  // beyond tilt's limit
  setup_.rig.unattended.reference = reference;
  restart();
  add_job(small_job(3));
  run_to_completion();
  EXPECT_THAT(visits(), IsEmpty());
  EXPECT_EQ(commits(), 3U);
  bool told = false;
  for (const auto& event : model_->events()) {
    told |= event.has_alarm() && event.alarm().text().starts_with("the last poses are not proven");
  }
  EXPECT_TRUE(told);
}

TEST_F(VisitTest, AfterAStopThePlaceOfTheSampleIsChecked) {
  add_job(small_job(4));
  run_until([&] { return commits() == 1; });
  protocol::Request stop;
  stop.mutable_stop();
  ask(stop);
  model_->moved = "the fiducials by 9.1 px";
  protocol::Request clear;
  clear.mutable_clear_stop();
  ask(clear);
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_THAT(entry().hold,
              HasSubstr("the sample or the rig moved since row 0 was taken: the fiducials by 9.1 px"));
  const std::size_t before = commits();
  run_for(100);
  EXPECT_EQ(commits(), before);
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
  EXPECT_EQ(entry().done, 4);
}

TEST_F(VisitTest, AWrongSampleIsNoticedBeforeTheFirstPose) {
  auto job = small_job(2);
  job.sample_fiducials = {1, 31};
  add_job(job);
  run_until([&] { return !entry().hold.empty(); });
  EXPECT_THAT(entry().hold, HasSubstr("its fiducials 31 are not seen"));
  EXPECT_EQ(commits(), 0U);
  model_->tags.push_back(31);
  ASSERT_EQ(release(1).outcome(), protocol::DONE);
  run_to_completion();
}

scan::VisitRecord visit_of(std::vector<double> patches, double dark) {
  scan::VisitRecord visit;
  visit.looks = {{"dark", "", 0.5, {}, "", {dark}}, {"patches", "", 0.02, {}, "", std::move(patches)}};
  return visit;
}

TEST(VisitVerdict, ComparesWithTheFirstVisit) {
  const machine::ReferenceConfig config = some_reference();
  const auto first = visit_of({1000, 500, 800}, 1);
  EXPECT_EQ(judge_visit(config, first, first, false).what, "");
  // All patches by the same factor: the light's level.
  auto verdict = judge_visit(config, first, visit_of({1015, 507.5, 812}, 1), false);
  EXPECT_EQ(verdict.what, "");
  EXPECT_NEAR(verdict.level, 1.015, 1e-12);
  EXPECT_NEAR(verdict.unevenness, 0, 1e-12);
  EXPECT_NE(judge_visit(config, first, visit_of({1025, 512.5, 820}, 1), false).what, "");
  // One patch alone: its evenness. Ratios 1, 1, 1.03: mean 1.01.
  verdict = judge_visit(config, first, visit_of({1000, 500, 824}, 1), false);
  EXPECT_NEAR(verdict.unevenness, 1.03 / 1.01 - 1, 1e-12);
  EXPECT_EQ(verdict.what, "");
  EXPECT_THAT(judge_visit(config, first, visit_of({1000, 500, 840}, 1), false).what, HasSubstr("uneven"));
}

TEST(VisitVerdict, ComparesTheFlatWithinItsOwnBand) {
  machine::ReferenceConfig config = some_reference();
  config.flat = some_flat();
  config.flat->band = 0.1;
  config.flat->evenness = 0.03;
  const auto visit_with = [](std::vector<double> flat) {
    auto visit = visit_of({1000}, 0);
    visit.looks.push_back({"flat", "", 0.01, {}, "", std::move(flat)});
    return visit;
  };
  const auto first = visit_with({2000, 1000});
  EXPECT_EQ(judge_visit(config, std::nullopt, first, false).what, "");
  auto verdict = judge_visit(config, first, visit_with({1840, 920}), false);
  EXPECT_EQ(verdict.what, "");
  EXPECT_NEAR(verdict.flat_level, 0.92, 1e-12);
  EXPECT_NEAR(verdict.flat_unevenness, 0, 1e-12);
  EXPECT_THAT(judge_visit(config, first, visit_with({1760, 880}), false).what,
              HasSubstr("the flat has 0.8800 of its first radiance"));
  // Ratios 1 and 0.9: mean 0.95.
  verdict = judge_visit(config, first, visit_with({2000, 900}), false);
  EXPECT_NEAR(verdict.flat_unevenness, 0.05 / 0.95, 1e-12);
  EXPECT_THAT(verdict.what, HasSubstr("a part of the flat departs"));
  EXPECT_THAT(judge_visit(config, first, visit_with({2000}), false).what,
              HasSubstr("1 parts of the flat are seen, 2 were at first"));
  for (const auto& dark : {std::vector<double>{}, std::vector<double>{2000, 3}}) {
    EXPECT_THAT(judge_visit(config, std::nullopt, visit_with(dark), false).what, HasSubstr("of the flat is"));
  }
  // What the scan's first visit did not have is not missed.
  EXPECT_EQ(judge_visit(config, visit_of({1000}, 0), first, false).what, "");
}

TEST(VisitVerdict, IsStricterAfterABadOne) {
  const machine::ReferenceConfig config = some_reference();
  const auto first = visit_of({1000}, 0);
  EXPECT_EQ(judge_visit(config, first, visit_of({1018}, 0), false).what, "");
  EXPECT_NE(judge_visit(config, first, visit_of({1018}, 0), true).what, "");
}

TEST(VisitVerdict, KnowsADarkPatchEvenOfTheFirstVisit) {
  EXPECT_NE(judge_visit(some_reference(), std::nullopt, visit_of({3}, 0), false).what, "");
  EXPECT_EQ(judge_visit(some_reference(), std::nullopt, visit_of({300}, 0), false).what, "");
  EXPECT_NE(judge_visit(some_reference(), std::nullopt, scan::VisitRecord{}, false).what, "");
  EXPECT_NE(judge_visit(some_reference(), visit_of({300}, 0),
                        visit_of({std::numeric_limits<double>::quiet_NaN()}, 0), false)
                .what,
            "");
}

using Outcome = VisitOutcome::Kind;

scan::VisitRecord visit_at(double minutes, double patch) {
  auto visit = visit_of({patch}, 0);
  visit.when = base::Time(base::seconds(60 * minutes));
  return visit;
}

// rigd that is started again and again makes a visit each time, all in one excursion.
TEST(VisitStandard, VisitsInOneExcursionCountOnce) {
  const machine::ReferenceConfig config = some_reference();
  const std::optional<scan::VisitRecord> standard = visit_at(0, 1000);
  std::optional<Rival> rival;
  constexpr int kAgreed = 2;
  for (const double minutes : {100.0, 101.0, 102.0, 103.0, 109.9}) {
    EXPECT_EQ(weigh_visit(config, standard, kAgreed, rival, visit_at(minutes, 800), false).kind,
              Outcome::bad);
  }
  ASSERT_TRUE(rival.has_value());
  EXPECT_EQ(rival->visits, 1);
  EXPECT_EQ(weigh_visit(config, standard, kAgreed, rival, visit_at(110, 800), false).kind, Outcome::bad);
  EXPECT_EQ(weigh_visit(config, standard, kAgreed, rival, visit_at(120, 801), false).kind, Outcome::replaces);
  EXPECT_FALSE(rival.has_value());
}

TEST(VisitStandard, OnlyVisitsInSuccessionCount) {
  const machine::ReferenceConfig config = some_reference();
  const std::optional<scan::VisitRecord> standard = visit_at(0, 1000);
  for (const double between : {1000.0, 700.0, 3.0}) {
    std::optional<Rival> rival;
    constexpr int kAgreed = 2;
    double minutes = 100;
    for (const double patch : {800.0, 800.0, between, 800.0, 800.0}) {
      EXPECT_NE(weigh_visit(config, standard, kAgreed, rival, visit_at(minutes += 20, patch), false).kind,
                Outcome::replaces)
          << between;
    }
    EXPECT_EQ(weigh_visit(config, standard, kAgreed, rival, visit_at(minutes + 20, 800), false).kind,
              Outcome::replaces);
  }
}

TEST(VisitStandard, TheRivalIsKnownAgainAfterARestart) {
  const machine::ReferenceConfig config = some_reference();
  scan::VisitsSoFar visits;
  visits.first = visit_at(0, 1000);
  visits.since_good = {visit_at(100, 600), visit_at(120, 800), visit_at(140, 805), visit_at(141, 800)};
  const auto rival = rival_of(config, visits, 3);
  ASSERT_TRUE(rival.has_value());
  EXPECT_EQ(rival->visits, 2);
  EXPECT_EQ(rival->first.when, visit_at(120, 0).when);
  EXPECT_EQ(rival->counted, visit_at(140, 0).when);
}

}  // namespace
}  // namespace rig::daemon::testing
