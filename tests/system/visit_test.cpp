// Reference visits and the check of the sample's place on the virtual rig, with frames that show its carrier.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <span>

#include "core/base/hash.h"
#include "core/scan/scan_directory.h"
#include "core/scan/verify.h"
#include "tests/system/running_rig.h"

namespace rig::test {
namespace {

using ::testing::HasSubstr;

std::string rig_with_reference() {
  return small_rig_toml() +
         "\n[reference]\npose_deg = [0, 8, 0, 75]\nexposure_ms = 20\ndark_exposure_ms = 500\nevery_poses = "
         "3\n";
}

std::string job(const std::string& further = "") {
  std::string text =
      "format = 1\nname = \"visits\"\nsample = \"chart\"\n" + further +
      "\n[exposure]\nstrategy = \"fixed\"\nexposures_us = [20000]\n\n[poses]\nangles_deg = [\n";
  for (int i = 0; i < 7; ++i) text += fmt::format("  [{}, {}, {}, {}],\n", 3 * i, 5 + i, 2 * i, 70 + 3 * i);
  return text + "]\n";
}

class Visit : public ::testing::Test {
 protected:
  void cause(const std::string& faults) {
    std::filesystem::create_directories(folder_ / "rig/state/virtual");
    put_bytes(folder_ / "rig/faults.new", faults);
    std::filesystem::rename(folder_ / "rig/faults.new", folder_ / "rig/state/virtual/faults.toml");
  }
  void mend() { std::filesystem::remove(folder_ / "rig/state/virtual/faults.toml"); }
  template <typename Wanted>
  void expect_event(Wanted wanted) {
    EXPECT_TRUE(rig_.await(wanted)) << rig_.log();
  }

  TemporaryFolder folder_;
  RunningRig rig_{folder_ / "rig", rig_with_reference()};
};

TEST_F(Visit, ProvesEveryPoseOfAJob) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job());
  EXPECT_EQ(rig_.await_job_end(), protocol::COMPLETE) << rig_.log();
  EXPECT_EQ(rig_.end(SIGTERM), 0);
  const auto journal = scan::Journal::open_read_only(scan::journal_path(rig_.scan()));
  ASSERT_TRUE(journal.has_value());
  const auto visits = journal->visits();
  ASSERT_TRUE(visits.has_value());
  ASSERT_EQ(visits->size(), 5U);  // first, repeated, after 3, after 6, last
  for (const auto& visit : *visits) {
    EXPECT_EQ(visit.good, visit.number > 0) << visit.what;
    EXPECT_EQ(visit.what, "");
    ASSERT_EQ(visit.looks.size(), 2U);
    EXPECT_NEAR(visit.looks[0].means_dn.at(0), 0, 1) << "the dark frame";
    EXPECT_EQ(visit.looks[1].means_dn.size(), 4U) << "all four patches are in the image";
    for (const double mean : visit.looks[1].means_dn) EXPECT_GT(mean, 50);
  }
  const auto report = scan::verify_scan(rig_.scan(), [](std::size_t) {});
  ASSERT_TRUE(report.has_value());
  EXPECT_TRUE(report->problems.empty());
  EXPECT_THAT(bytes_in(rig_.scan() / "report.txt"), HasSubstr("Reference: 5 visits"));
}

TEST_F(Visit, TakesAFlatOfATargetAtItsOwnPose) {
  RunningRig rig(folder_ / "flat", rig_with_reference() +
                                       "\n[reference.flat]\npose_deg = [0, 12, 0, 60]\nexposure_ms = 30\n"
                                       "target_mm = [0, 95, 24, 16]\nband = 0.05\nevenness = 0.1\n");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  protocol::Request check;
  check.mutable_check_job()->set_job_toml(job());
  const auto flight = rig.expect_done(check).preflight();
  rig.submit(job());
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  const auto journal = scan::Journal::open_read_only(scan::journal_path(rig.scan()));
  ASSERT_TRUE(journal.has_value());
  const auto visits = journal->visits();
  ASSERT_TRUE(visits.has_value());
  ASSERT_EQ(visits->size(), 5U);
  EXPECT_EQ(flight.visits(), 5U);
  EXPECT_EQ(flight.frames(), 7U + 5 * 3);
  for (const auto& visit : *visits) {
    EXPECT_EQ(visit.what, "");
    ASSERT_EQ(visit.looks.size(), 3U);
    EXPECT_EQ(visit.looks[2].name, "flat");
    ASSERT_EQ(visit.looks[2].means_dn.size(), 16U);
    for (const double mean : visit.looks[2].means_dn) EXPECT_GT(mean, 50);
    EXPECT_TRUE(std::filesystem::exists(rig.scan() / visit.looks[2].file));
  }
  // What was foreseen is what was written.
  double written = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(rig.scan())) {
    if (entry.path().extension() == ".tif") written += static_cast<double>(entry.file_size());
  }
  EXPECT_GE(static_cast<double>(flight.bytes_needed()), written);
  EXPECT_LE(static_cast<double>(flight.bytes_needed()), 1.2 * written);
  protocol::Request report;
  report.mutable_get_report()->set_job(1);
  const auto told = rig.expect_done(report).report();
  ASSERT_EQ(told.visits_size(), 5);
  EXPECT_NEAR(told.visits(4).flat_level(), 1, 0.05);
  EXPECT_EQ(rig.end(SIGTERM), 0);
  EXPECT_THAT(bytes_in(rig.scan() / "report.txt"), HasSubstr(", the flat between "));
  const auto verified = scan::verify_scan(rig.scan(), [](std::size_t) {});
  ASSERT_TRUE(verified.has_value());
  EXPECT_TRUE(verified->problems.empty());
}

TEST_F(Visit, ALightThatIsNotAsItWasShowsInTheFlatAlone) {
  // Patches may be as they like.
  RunningRig rig(folder_ / "flat", rig_with_reference() +
                                       "band = 0.5\n\n[reference.flat]\nexposure_ms = 30\nband = 0.02\n"
                                       "target_mm = [0, 95, 24, 16]\nevenness = 0.1\n");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job());
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_committed(); }));
  std::filesystem::create_directories(folder_ / "flat/state/virtual");
  put_bytes(folder_ / "flat/faults.new", "[[fault]]\nkind = \"light-excursion\"\nshare = -0.04\n");
  std::filesystem::rename(folder_ / "flat/faults.new", folder_ / "flat/state/virtual/faults.toml");
  protocol::ReferenceVisited bad;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    if (event.has_reference_visited()) bad = event.reference_visited();
    return event.has_reference_visited() && !bad.good() && !bad.what().empty();
  })) << rig.log();
  EXPECT_THAT(bad.what(), HasSubstr("the flat has 0.9"));
  EXPECT_NEAR(bad.flat_level(), 0.96, 0.01);
  EXPECT_EQ(bad.poses_again(), 3U);
  std::filesystem::remove(folder_ / "flat/state/virtual/faults.toml");
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0);
}

TEST_F(Visit, ALampThatLosesLightIsNoticedAndThePosesAreTakenAgain) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job());
  expect_event([](const protocol::Event& event) { return event.has_pose_committed(); });
  cause("[[fault]]\nkind = \"light-excursion\"\nshare = -0.04\n");  // within [suspend] light_band
  protocol::ReferenceVisited bad;
  expect_event([&](const protocol::Event& event) {
    if (event.has_reference_visited()) bad = event.reference_visited();
    return event.has_reference_visited() && !bad.good() && !bad.what().empty();
  });
  EXPECT_THAT(bad.what(), HasSubstr("of their first radiance"));
  EXPECT_NEAR(bad.level(), 0.96, 0.005);
  EXPECT_EQ(bad.poses_again(), 3U);
  mend();
  EXPECT_EQ(rig_.await_job_end(), protocol::COMPLETE) << rig_.log();
  EXPECT_EQ(rig_.end(SIGTERM), 0);
  const auto report = scan::verify_scan(rig_.scan(), [](std::size_t) {});
  ASSERT_TRUE(report.has_value());
  EXPECT_TRUE(report->complete());
  EXPECT_THAT(bytes_in(rig_.scan() / "report.txt"), HasSubstr("reference: the reference patches have 0.9"));
}

TEST_F(Visit, AfterARestartTheFiducialsAreWhereTheyWere) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job());
  int committed = 0;
  expect_event([&](const protocol::Event& event) { return event.has_pose_committed() && ++committed == 2; });
  EXPECT_EQ(rig_.end(SIGKILL), -SIGKILL);
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  protocol::PlaceChecked checked;
  expect_event([&](const protocol::Event& event) {
    if (event.has_place_checked()) checked = event.place_checked();
    return event.has_place_checked();
  });
  EXPECT_EQ(checked.problem(), "");
  EXPECT_GE(checked.tags_size(), 10);
  EXPECT_EQ(rig_.await_job_end(), protocol::COMPLETE) << rig_.log();
  EXPECT_EQ(rig_.end(SIGTERM), 0);
}

TEST_F(Visit, ASampleThatWasPushedMeanwhileHoldsTheJob) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job());
  int committed = 0;
  expect_event([&](const protocol::Event& event) { return event.has_pose_committed() && ++committed == 2; });
  EXPECT_EQ(rig_.end(SIGKILL), -SIGKILL);
  // The camera was knocked: the simulated one now looks 3 px past where it looked.
  const std::string text = bytes_in(folder_ / "rig/rig.toml");
  const auto first = text.find("cx_px = 200.8");
  ASSERT_NE(first, std::string::npos);
  put_bytes(folder_ / "rig/rig.toml", std::string(text).replace(first, 13, "cx_px = 205.3"));
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  std::string hold;
  expect_event([&](const protocol::Event& event) {
    if (event.has_job_changed()) hold = event.job_changed().job().hold();
    return !hold.empty();
  });
  EXPECT_THAT(hold, HasSubstr("the sample or the rig moved since row 1 was taken"));
  protocol::Request abort;
  abort.mutable_abort_job()->set_job(1);
  rig_.expect_done(abort);
  EXPECT_EQ(rig_.end(SIGTERM), 0);
}

TEST_F(Visit, TheWrongSampleIsNotMeasured) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job("sample_fiducials = [0, 77]\n"));
  std::string hold;
  expect_event([&](const protocol::Event& event) {
    if (event.has_job_changed()) hold = event.job_changed().job().hold();
    return !hold.empty();
  });
  EXPECT_THAT(hold, HasSubstr("its fiducials 77 are not seen"));
  protocol::Request abort;
  abort.mutable_abort_job()->set_job(1);
  rig_.expect_done(abort);
  EXPECT_EQ(rig_.end(SIGTERM), 0);
}

TEST_F(Visit, AFrameIsFetchedByTheClientWhateverLiesThereFromBefore) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job());
  EXPECT_EQ(rig_.await_job_end(), protocol::COMPLETE) << rig_.log();
  const std::string stored = bytes_in(rig_.scan() / "frames/000004/00.tif");
  const std::filesystem::path out = folder_ / "frame.tif";
  const std::filesystem::path part = folder_ / "frame.tif.part";
  const auto fetch = [&](const std::string& row) {
    return run_program("rig",
                       {"frame", "1", row, "0", "--out", out, "--endpoint",
                        "ipc://" + (folder_ / "rig/run/operate.sock").string()},
                       folder_ / "rig-frame.log");
  };
  std::string half = stored.substr(0, stored.size() / 2);
  std::string corrupt = half;
  corrupt[1000] = static_cast<char>(corrupt[1000] ^ 1);
  for (const std::string& before :
       {std::string(), half, corrupt, stored, stored + "and more", corrupt + stored}) {
    std::filesystem::remove(out);
    put_bytes(part, before);
    ASSERT_EQ(fetch("4"), 0) << before.size() << "\n" << bytes_in(folder_ / "rig-frame.log");
    EXPECT_EQ(bytes_in(out), stored);
    EXPECT_FALSE(std::filesystem::exists(part));
  }
  std::filesystem::remove(out);
  EXPECT_NE(fetch("400"), 0);
  EXPECT_FALSE(std::filesystem::exists(out));
  // A frame whose file is damaged on rigd's disk is not handed out as good.
  std::string damaged = stored;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  put_bytes(rig_.scan() / "frames/000004/00.tif", damaged);
  EXPECT_NE(fetch("4"), 0);
  EXPECT_THAT(bytes_in(folder_ / "rig-frame.log"), HasSubstr("another hash than the journal has"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_FALSE(std::filesystem::exists(part));
  EXPECT_EQ(rig_.end(SIGTERM), 0);
}

TEST_F(Visit, AFrameIsFetchedInPieces) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  rig_.submit(job());
  EXPECT_EQ(rig_.await_job_end(), protocol::COMPLETE) << rig_.log();
  std::string bytes;
  protocol::FramePiece piece;
  do {
    protocol::Request get;
    get.mutable_get_frame()->set_job(1);
    get.mutable_get_frame()->set_row(4);
    get.mutable_get_frame()->set_offset(bytes.size());
    get.mutable_get_frame()->set_length(100000);
    piece = rig_.expect_done(get).frame_piece();
    ASSERT_FALSE(piece.content().empty());
    EXPECT_EQ(piece.offset(), bytes.size());
    bytes += piece.content();
  } while (bytes.size() < piece.file_bytes());
  EXPECT_EQ(piece.sha256(), base::sha256_hex(std::as_bytes(std::span(bytes))));
  EXPECT_EQ(bytes, bytes_in(rig_.scan() / "frames/000004/00.tif"));
  protocol::Request beyond;
  beyond.mutable_get_frame()->set_job(1);
  beyond.mutable_get_frame()->set_row(400);
  EXPECT_EQ(rig_.ask(beyond).outcome(), protocol::FAILED);
  EXPECT_EQ(rig_.end(SIGTERM), 0);
}

}  // namespace
}  // namespace rig::test
